// A thin lens over a finished picture, in linear display light: each pixel gathers from those whose own disc reaches it, what lies behind
// it no farther than its own disc (Potmesil and Chakravarty 1981, doi:10.1145/800224.806818; gathered as in Jimenez 2014, "Next generation post
// processing in Call of Duty: Advanced Warfare").
#include "shaders/common.glsl"
#include "shaders/display.glsl"
uniform sampler2D picture; uniform sampler2D confusion;
uniform float largest;  // px: radius of the largest disc in the picture
out vec4 pixel;

const int TAPS = 48;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(picture, 0) - 1;
    vec2 here = texelFetch(confusion, at, 0).xy;
    float own = abs(here.x), phase = 2.0 * PI * interleaved_gradient_noise(gl_FragCoord.xy);
    float depth = here.y > 0.0 ? here.y : 1e9;
    float reach = own;  // only what is nearer can spread farther than this pixel does
    for (int k = 0; k < 8; ++k) {
        vec2 there = texelFetch(confusion, clamp(at + ivec2(largest * vogel(k, 8, phase)), ivec2(0), last), 0).xy;
        if (there.y > 0.0 && there.y < depth) reach = max(reach, abs(there.x));
    }
    vec3 sum = texelFetch(picture, at, 0).rgb;
    float weight = 1.0 / max(own * own, 0.25);
    sum *= weight;
    if (reach > 0.5) for (int k = 0; k < TAPS; ++k) {
        // evenly along the radius and not over the area: small discs lie within large ones, at every silhouette
        float along = (float(k) + 0.5) / float(TAPS), angle = 2.39996323 * float(k) + phase;
        vec2 offset = reach * along * vec2(cos(angle), sin(angle));
        ivec2 tap = clamp(at + ivec2(round(offset)), ivec2(0), last);
        vec2 there = texelFetch(confusion, tap, 0).xy;
        float radius = abs(there.x);
        if ((there.y > 0.0 ? there.y : 1e9) > depth) radius = min(radius, own);
        float w = 2.0 * along * clamp(radius - length(offset) + 0.5, 0.0, 1.0) / max(radius * radius, 0.25) * reach * reach / float(TAPS);
        sum += w * texelFetch(picture, tap, 0).rgb;
        weight += w;
    }
    pixel = vec4(displayed(sum / weight, gl_FragCoord.xy), 1.0);
}
