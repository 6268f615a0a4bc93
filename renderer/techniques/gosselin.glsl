// One Poisson blur of the light map: twelve taps and their middle, all of one weight (eq. 13).
#include "techniques/atlas_tap.glsl"
uniform vec2 offsets[12];  // mm
uniform int taps;  // 12; no constant: an unrolled loop would run for empty texels too
out vec4 blurred;

void main() {
    Texel t;
    blurred = vec4(0.0);
    if (!begin(t)) return;
    vec3 sum = t.own.rgb;
    for (int k = 0; k < taps; ++k) sum += tap(t, offsets[k] / t.mm, length(offsets[k]));
    blurred = vec4(sum / float(taps + 1), 1.0);
}
