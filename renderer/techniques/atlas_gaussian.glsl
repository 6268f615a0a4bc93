// One axis of one Gaussian over the atlas.
#include "techniques/atlas_tap.glsl"
#define MOST_TAPS 49
uniform float taps[MOST_TAPS];
uniform float sigma;  // mm, incremental
uniform float spacing;  // of taps, in sigma
uniform int reach;    // taps each way; no constant: an unrolled loop would run for empty texels too
uniform vec2 axis;
out vec4 blurred;

void main() {
    Texel t;
    blurred = vec4(0.0);
    if (!begin(t)) return;
    float step_mm = spacing * sigma, texels = step_mm / dot(t.mm, axis);
    vec3 sum = taps[reach] * t.own.rgb;
    for (int k = -reach; k <= reach; ++k)
        if (k != 0) sum += taps[k + reach] * tap(t, float(k) * texels * axis, abs(float(k)) * step_mm);
    blurred = vec4(sum, 1.0);
}
