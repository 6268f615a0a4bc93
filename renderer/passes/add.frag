// What a technique is given: the irradiance of one medium, with the light that comes through it from behind
// (Jimenez 2010: not shadowed, and before scattering) or without.
uniform sampler2D irradiance; uniform sampler2D transmitted;
uniform float medium;   // the id in the irradiance's alpha
uniform float through;  // 1 or 0
layout(location = 0) out vec4 total;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 e = texelFetch(irradiance, at, 0);
    float own = abs(e.a - medium) < 0.5 ? 1.0 : 0.0;
    total = vec4(e.rgb + own * through * texelFetch(transmitted, at, 0).rgb, own);
}
