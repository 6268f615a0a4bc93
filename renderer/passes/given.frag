// What a technique is given: the irradiance of one medium, with the light that comes through it from behind
// (Jimenez 2010: not shadowed, and before scattering) or without.
uniform sampler2D irradiance; uniform sampler2D transmitted; uniform sampler2D albedo;
uniform float medium;   // the id in the irradiance's alpha
uniform float through;  // 1 or 0
uniform int first_row;    // of what is drawn, in these
uniform float texturing;  // 0: post-scatter, 1: the whole albedo before scattering
layout(location = 0) out vec4 total;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) + ivec2(0, first_row);
    vec4 e = texelFetch(irradiance, at, 0);
    float own = abs(e.a - medium) < 0.5 ? 1.0 : 0.0;
    vec3 light = e.rgb + own * through * texelFetch(transmitted, at, 0).rgb;
    if (own > 0.0 && texturing > 0.0) light *= pow(max(texelFetch(albedo, at, 0).rgb, 1e-6), vec3(texturing));
    total = vec4(light, own);
}
