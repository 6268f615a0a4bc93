// An eye: a cornea that refracts, an iris behind it, a sclera with vessels, the corner's tissue, and tears over all of it.
#include "shaders/common.glsl"
#include "shaders/noise.glsl"
#include "shaders/lighting.glsl"
#include "passes/surface_out.glsl"
#include "passes/lids.glsl"
#include "passes/cornea.glsl"
uniform vec3 centre; uniform vec3 gaze;
uniform float size;                    // mm in the world, a mm of the head
uniform sampler2D edges; uniform int has_edges;
uniform sampler2D vessels; uniform float vessels_rad;
uniform vec3 iris_base; uniform vec3 iris_fibres; uniform vec3 iris_collarette; uniform vec3 sclera_colour;
uniform float pupil_mm; uniform float limbus_mm; uniform float limbus; uniform float veins; uniform float redness;
uniform float lid_shade; uniform float lid_shade_mm; uniform vec4 lid_shade_shares; uniform float lash_veil; uniform float meniscus_mm;
uniform vec2 tears_rad;                // over which a lamp's edge is blurred in the tears: over the cornea, and over the uneven sclera and the corner's tissue
uniform vec3 noise_origin;
const float SPREAD_MM = 0.9;           // of light in the sclera
const float F0 = 0.0207;               // Fresnel at the tears' index of 1.336
const float MENISCUS = 0.16;           // and in the meniscus, whose bend is narrower than a pixel

// Colour of the iris at q, mm of the gaze's frame; detail finer than a pixel fades.
vec3 iris_colour(vec2 q, float pixel_mm, float seed) {
    float rim = length(q), pupil = pupil_mm, outer = iris_radius;
    float t = clamp((rim - pupil) / (outer - pupil), 0.0, 1.2);  // 0 at the pupil, 1 at the root
    vec2 around = q / max(rim, 1e-3);
    vec2 wind = around + 0.045 * vec2(noise(vec3(around * 6.0, t * 3.0 + seed)), noise(vec3(around * 6.0, t * 3.0 + 9.0 + seed)));
    float sharp = 1.0 / (1.0 + 30.0 * pixel_mm * pixel_mm);
    // fibres: radial strands, finer ones over coarser ones, that wind a little
    float fibre = 0.50 * noise(vec3(wind * 15.0, t * 1.1 + seed)) + 0.38 * noise(vec3(wind * 32.0, t * 1.8 + seed + 4.0)) * (0.4 + 0.6 * sharp)
        + 0.30 * noise(vec3(wind * 62.0, t * 2.6 + seed + 8.0)) * sharp;
    vec3 c = mix(iris_base, iris_fibres, clamp(0.42 + 0.95 * fibre, 0.0, 1.25));
    // the collarette: a wavy ring a third of the way out; within it the pupillary zone, flatter and warmer
    float ring = 0.30 + 0.07 * noise(vec3(around * 4.0, seed + 1.0)) + 0.05 * noise(vec3(around * 11.0, seed + 2.0));
    float within = 1.0 - smoothstep(ring - 0.10, ring + 0.14, t);
    c = mix(c, iris_collarette * (1.0 + 0.40 * fibre), 0.46 * within);
    c = mix(c, iris_collarette * (1.05 + 0.8 * fibre), 0.30 * exp(-pow((t - ring - 0.16) / 0.16, 2.0)));
    c *= 1.0 + 0.30 * exp(-pow((t - ring) / 0.045, 2.0));
    // crypts: gaps between strands that show the dark stroma, mostly just outside the collarette
    Cells gap = cells(vec3(wind * 4.6, t * 2.7 + seed));
    float crypt = (1.0 - smoothstep(0.18, 0.42, gap.f1)) * step(0.62, unit(mix_bits(gap.id ^ 5u))) * smoothstep(ring, ring + 0.07, t) * (1.0 - smoothstep(0.62, 0.85, t));
    c *= 1.0 - 0.42 * crypt;
    // furrows of contraction: faint arcs near the root
    float arc = (t + 0.02 * noise(vec3(around * 3.0, seed))) * 9.0;
    c *= 1.0 - 0.10 * smoothstep(0.55, 0.75, t) * pow(0.5 + 0.5 * cos(2.0 * PI * arc), 4.0);
    // the root is dark, the ruff about the pupil too
    c *= mix(1.0, 0.42, smoothstep(0.72, 1.02, t));
    c *= mix(0.35, 1.0, smoothstep(0.0, 0.055, t));
    float edge = max(0.045, 0.7 * pixel_mm);
    return c * smoothstep(pupil - edge, pupil + edge, rim + 0.02 * noise(vec3(around * 9.0, 2.0)));
}

void main() {
    vec3 v = normalize(camera_position - world);
    float phase = 2.0 * PI * interleaved_gradient_noise(gl_FragCoord.xy);
    float tissue = a.x, sheet = min(4.0 * tissue, 1.0), caruncle = a.y, pixel_mm = footprint_mm() / size;
    vec3 up = normalize(vec3(0.0, 1.0, 0.0) - gaze * gaze.y), side = cross(up, gaze);
    mat3 frame = mat3(side, up, gaze);                  // of the gaze to the world
    vec3 own = (world - centre) / size, p = own * frame;  // mm from the centre, in the world's axes and in the gaze's
    vec3 front = transpose(mat3(model)) * own / size;     // in the head's axes
    float rim = length(p.xy);

    // the cornea's normal is exact: the mesh is not fine enough for a mirror
    vec3 n = normalize(world_normal);
    if (tissue > 0.0) n = normalize(mix(normalize(own), n, smoothstep(0.0, 0.35, tissue)));  // the fold goes over into the ball
    float in_cap = (1.0 - tissue) * (1.0 - smoothstep(iris_radius - 0.22, iris_radius + 0.22, rim)) * step(0.0, p.z);
    n = normalize(mix(n, frame * normalize(p - vec3(0.0, 0.0, cap_z())), in_cap));

    // how far the lids' edges are, and their shade
    vec2 edge = has_edges == 1 ? to_edges(edges, edges_mm, front.xy) : vec2(20.0);
    float over = lid_shade_shares.x * lid_shade * exp(-max(edge.y, 0.0) / (0.4 * lid_shade_mm));
    float corner = lid_shade_shares.y * lid_shade * (1.0 - 0.6 * sheet) * exp(-max(edge.x + edge.y - 1.0, 0.0) / 3.4);
    // where a lid's rim touches the ball hardly any light comes in
    float touch = lid_shade_shares.z * lid_shade * (1.0 - sheet) * max(exp(-max(edge.x, 0.0) / 0.35), 0.55 * exp(-max(edge.y, 0.0) / 0.22));

    // iris, seen through the cornea
    vec3 q = to_iris(p, n * frame, -v * frame);
    // A diffuse surface below a face of index m: radiance falls by m^2 on its way out, 2 % are lost each way, and of what the face sends
    // back inside, 45 %, the iris returns its share.
    float seed = floor(noise_origin.x) * 0.37;
    vec3 iris = iris_colour(q.xy, pixel_mm, seed);
    iris *= 0.96 / (AQUEOUS * AQUEOUS * (1.0 - 0.45 * min(iris, 1.0)));

    // sclera: vessels that lie on the ball, more red in the corners and below the lids
    float angle = acos(clamp(p.z / max(length(p), 1e-3), -1.0, 1.0));
    vec2 on_map = p.xy / max(rim, 1e-3) * angle / vessels_rad;
    float vessel = texture(vessels, on_map * 0.5 + 0.5).r;
    vec3 solid = front + noise_origin;
    float outward = smoothstep(iris_radius * 1.1, iris_radius * 1.95, rim);
    vec3 sclera = sclera_colour * (1.0 + 0.05 * fbm(solid / 2.2));
    float flush = redness * (0.10 + 0.42 * outward + 0.20 * exp(-max(min(edge.x, edge.y), 0.0) / 0.8) + 0.45 * exp(-max(edge.x + edge.y - 1.5, 0.0) / 1.8)) * (0.8 + 0.5 * fbm(solid / 3.1 + 5.0));
    sclera *= exp(-max(flush, 0.0) * vec3(0.10, 0.52, 0.50));
    sclera *= mix(vec3(1.0), vec3(0.93, 0.85, 0.72), 0.8 * smoothstep(0.45, 1.15, angle));  // fat below the conjunctiva is yellowish
    sclera *= exp(-veins * vessel * vec3(0.75, 2.6, 2.35) * (0.55 + 0.45 * outward));
    // the limbus: the sclera overlaps the cornea softly, and a grey-blue ring lies under it
    float ragged = 0.16 * noise(vec3(normalize(p.xy + 1e-4) * 5.0, seed)) + 0.06 * noise(vec3(normalize(p.xy + 1e-4) * 17.0, seed));
    float white = smoothstep(iris_radius - 0.75 * limbus_mm, iris_radius + 0.45 * limbus_mm, rim + ragged);
    white = max(white, step(p.z, 0.0));
    vec3 albedo = mix(iris, sclera, white);
    // it is broader above and below, where the sclera reaches farther over the cornea, and not equally dark all round
    float wide = 0.55 + 0.20 * abs(p.y) / max(rim, 1e-3), dark = 0.85 + 0.35 * noise(vec3(normalize(p.xy + 1e-4) * 1.7, seed + 3.0));
    float from = rim - iris_radius + 0.10 * limbus_mm;
    float ring = exp(-pow(from / ((from < 0.0 ? wide : 1.35 * wide) * limbus_mm), 2.0)) * step(0.0, p.z);
    albedo *= 1.0 - min(limbus * dark, 0.95) * ring * vec3(1.0, 0.98, 0.92);
    // light that ends on the iris came in higher on the cornea, nearer to the lid and its lashes; the ball's sides turn away from it
    float behind = 1.0 - max(white, sheet);
    float under = min(lid_shade * (1.0 + 0.30 * behind), 1.0) * exp(-max(edge.x - 0.9 * behind, 0.0) / lid_shade_mm);
    float sides = lid_shade_shares.w * lid_shade * (1.0 - 0.6 * sheet) * smoothstep(0.55, 1.25, angle);
    vec3 shade = pow(vec3((1.0 - under) * (1.0 - over) * (1.0 - corner) * (1.0 - sides) * (1.0 - touch)), vec3(0.90, 1.06, 1.12));  // lids send back red light
    // the corner: the fold is pink, the caruncle redder and dull
    // no brighter than the sclera that it stands beside
    vec3 flesh = mix(vec3(1.24, 0.84, 0.79), vec3(1.30, 0.80, 0.71), caruncle) * sclera_colour * (1.0 + 0.22 * fbm(solid / 0.55) - 0.14 * fbm(solid / 0.25));
    albedo = mix(albedo, flesh, clamp(tissue * (1.0 + 0.5 * noise(solid / 0.6)), 0.0, 1.0));

    // tears: thin everywhere, with a meniscus along the lids where the normal swings away from them
    vec3 wet_n = n;
    float wet = 0.0;
    if (has_edges == 1 && meniscus_mm > 0.0) {
        for (int k = 0; k < 2; ++k) {
            float d = k == 0 ? edge.x : edge.y, tall = k == 0 ? 0.6 * meniscus_mm : meniscus_mm * max(1.0 + 0.5 * noise(solid / 1.3) + 0.4 * noise(solid / 0.5), 0.1);
            float t = (1.0 - clamp(d / tall, 0.0, 1.0)) * smoothstep(-0.5, -0.1, d);  // none on a ball that stands out of its lids
            wet = max(wet, t);
            vec2 away = away_from_edge(edges, edges_mm, front.xy, k);
            wet_n = normalize(wet_n + mat3(model) * vec3(away, 0.15) / size * (1.9 * t * t));
        }
    }
    float lumps = mix(mix(0.010, 0.055, white), 0.20, tissue) / (1.0 + 20.0 * pixel_mm * pixel_mm);
    wet_n = normalize(wet_n + lumps * vec3(noise(solid / 0.7), noise(solid / 0.7 + 7.0), noise(solid / 0.7 + 13.0)));

    vec3 baked = max(vec3(dot(light[0], n), dot(light[1], n), dot(light[2], n)), 0.0);
    vec3 irradiance = baked * (1.0 - lash_veil * (1.0 - sheet));  // no strand was there when that was baked
    vec3 specular = vec3(0.0), r = reflect(-v, wet_n), qn = vec3(q.xy, iris_z(length(q.xy)));
    if (dot(r, n) < 0.0) r = normalize(r - n * (dot(r, n) - 0.02));
    float nv = max(dot(wet_n, v), 0.02), mirror = schlick(F0, nv);
    strand_disc_mm = 1.6;  // what passes between lashes is blurred
    vec3 across = normalize(cross(n, vec3(0.0, 1.0, 0.01))), along = cross(n, across);
    for (int k = 0; k < lamps; ++k) {
        vec3 l = lamp_towards(k, world), light_here = lamp_light(k, world);
        // light that enters the sclera comes out up to a millimetre away, so shadows of lids have soft edges there
        float seen = 0.0;
        for (int j = 0; j < 4; ++j) {
            vec2 o = SPREAD_MM * size * vogel(j, 4, phase);
            seen += 0.25 * visibility(k, world + across * o.x + along * o.y, n, phase + 1.3 * float(j));
        }
        float on_iris = through_cornea(qn, l * frame);
        float on_white = 0.8 * smoothstep(-0.25, 1.0, dot(n, l));  // light wraps: the sclera scatters, and adds none to what falls on the ball
        irradiance += light_here * seen * mix(on_iris, on_white, max(white, tissue));
        specular += seen * mirror * lamp_mirrored(k, world, r, max(mix(tears_rad.x, tears_rad.y, max(white, tissue)), MENISCUS * smoothstep(0.0, 0.4, wet)));
    }
    irradiance *= shade * (1.0 + 0.25 * sheet);  // light comes to the corner through the lids about it too
    // what is around, mirrored; the upper lid and its lashes stand before it
    float free = smoothstep(0.12, 0.55, open_sky) * smoothstep(-0.3, 1.6, edge.x) * (1.0 - 0.6 * tissue);
    specular += environment(r, 1500.0) * mirror * free;
    if (tissue > 0.0) specular *= 1.0 - 0.85 * exp(-pow((tissue - 0.12) / 0.22, 2.0));  // no bright line where the fold meets the ball
    out_irradiance = vec4(irradiance, 0.0);
    out_specular = vec4(specular, 1.0);
    out_albedo = vec4(albedo, 1.0);
    put_place(n);
}
