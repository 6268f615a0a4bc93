// Radiance of points of strands towards the camera. Three lobes of a fibre, R, TT and TRT, by Marschner et al. 2003,
// doi:10.1145/882262.882345 (shifts and widths of its table 1), their azimuths by Karis 2016's fits to d'Eon et al. 2011,
// doi:10.1111/j.1467-8659.2011.01976.x ("Physically based hair shading in Unreal"); light that other fibres pass on as in Zinke et al.
// 2008's dual scattering, doi:10.1145/1360612.1360631, with one mean colour a fibre.
#include "shaders/common.glsl"
#include "shaders/lighting.glsl"
uniform sampler2D places; uniform sampler2D tangents; uniform sampler2D covers;
uniform sampler2D normals;       // a strand's: of the skin at its root
uniform sampler2D colours;       // a strand's: rgb: what two ways through the fibre leave of light; w: share of mirrored light that whole scales would mirror
uniform sampler2D environments;  // a strand's: light from everywhere on the skin at the root; w: its first point
uniform sampler2DArray lit_map;  // (passes/hair_lit.frag)
uniform vec2 leaves;             // mm from the root: hair that hangs far from it is lit from where it is
uniform float extinction;        // of the whole layer along its normal
uniform float tilt;              // of the cuticle's scales, radians
uniform float spread;            // standard deviation of R, radians
uniform float index;
layout(location = 0) out vec4 radiance;

float lobe(float x, float width) { return exp(-0.5 * x * x / (width * width)) / (width * 2.5066); }

// Scattering times the cosine to the fibre's normal plane; t points to the tip. Longitudinal lobes are normal distributions of the sum of
// the two sines, which has twice the width of Marschner's half angle.
vec3 fibre(vec3 t, vec3 l, vec3 v, vec3 colour, float f0, float sheen) {
    float si = clamp(dot(t, l), -0.999, 0.999), so = clamp(dot(t, v), -0.999, 0.999);
    float ci = sqrt(1.0 - si * si), co = sqrt(1.0 - so * so);
    float cd = max(cos(0.5 * (asin(so) - asin(si))), 0.2), sum = si + so;
    float cp = clamp(dot(l - si * t, v - so * t) / (ci * co), -1.0, 1.0), ch = sqrt(0.5 + 0.5 * cp);
    // R: mirrored by scales that lean to the tip, so its highlight lies nearer the root
    vec3 s = vec3(0.25 * sheen * ch * schlick(f0, sqrt(clamp(0.5 + 0.5 * dot(l, v), 0.0, 1.0))) * lobe(sum + 2.0 * tilt, 2.0 * spread));
    float bent = 1.19 / cd + 0.36 * cd, a = 1.0 / bent;
    float h = ch * (1.0 + a * (0.6 - 0.8 * cp));
    float f = schlick(f0, cd * sqrt(clamp(1.0 - h * h, 0.0, 1.0)));
    vec3 c = max(colour, 1e-4);
    s += (1.0 - f) * (1.0 - f) * pow(c, vec3(0.5 * sqrt(max(1.0 - h * h * a * a, 0.0)) / cd)) * exp(-3.65 * cp - 3.98) * lobe(sum - tilt, spread);
    f = schlick(f0, 0.5 * cd);
    s += (1.0 - f) * (1.0 - f) * f * pow(c, vec3(0.8 / cd)) * exp(17.0 * cp - 16.78) * lobe(sum - 3.0 * tilt, 4.0 * spread);
    return s * ci;
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 p = texelFetch(places, at, 0).xyz;
    vec4 t = texelFetch(tangents, at, 0);
    int strand = int(t.w + 0.5), columns = textureSize(colours, 0).x;
    ivec2 own = ivec2(strand % columns, strand / columns);
    vec4 cover = vec4(texelFetch(normals, own, 0).xyz, texelFetch(covers, at, 0).r);  // w: of the layer above
    vec4 fibre_own = texelFetch(colours, own, 0);
    vec3 colour = fibre_own.rgb;
    float sheen = fibre_own.w;
    vec4 rooted = texelFetch(environments, own, 0);
    int first = int(rooted.w + 0.5);
    vec3 v = normalize(camera_position - p);
    float root = (index - 1.0) / (index + 1.0), f0 = root * root;
    vec3 forward = sqrt(max(colour, 1e-4));  // one way through, what a fibre passes on
    // light from everywhere: past the layer above, back from the fibre or through it and back from another, and mirrored
    float away = distance(p, texelFetch(places, ivec2(first % textureSize(places, 0).x, first / textureSize(places, 0).x), 0).xyz);
    float hanging = smoothstep(leaves.x, leaves.y, away);
    // what is seen of a curtain of hair is open towards who sees it
    float open_to = exp(-extinction * cover.w * (1.0 - 0.6 * hanging));
    vec3 n = cover.xyz - t.xyz * dot(cover.xyz, t.xyz);
    n += mix(0.35, 1.5, hanging) * (v - t.xyz * dot(v, t.xyz));
    n /= max(length(n), 1e-3);
    // a neck stands somewhere behind it
    vec3 around = mix(rooted.rgb, 0.8 * PI * environment(n, 2.0), hanging);
    vec3 sum = around * open_to * (colour + 0.2 * forward) / PI;
    float facing = max(dot(n, v), 0.05);
    // what is mirrored near the root lies over the skin's horizon
    vec3 mirrored = reflect(-v, n);
    float above = mix(smoothstep(-0.1, 0.5, dot(mirrored, cover.xyz)), 1.0, hanging);
    sum += environment(mirrored, 6.0) * schlick(f0, facing) * open_to * 0.2 * sheen * above;
    for (int k = 0; k < lamps; ++k) {
        vec2 lit = texelFetch(lit_map, ivec3(at, k), 0).rg;
        if (lit.y <= 0.0) continue;
        vec3 l = lamp_towards(k, p);
        float si = dot(t.xyz, l), ci = sqrt(max(1.0 - si * si, 0.0));
        float straight = exp(-lit.x);
        vec3 passed = (1.0 - straight) * 0.7 * pow(forward, vec3(1.0 + 0.8 * lit.x));
        vec3 scattered = straight * fibre(t.xyz, l, v, colour, f0, sheen) + (0.75 * straight * colour + passed * colour) * ci / PI;
        sum += lamp_light(k, p) * lit.y * scattered;
    }
    radiance = vec4(sum, 1.0);
}
