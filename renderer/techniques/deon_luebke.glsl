// One axis of one Gaussian over the atlas.
#include "techniques/atlas_tap.glsl"
uniform float taps[7];
uniform float sigma;  // mm, incremental
uniform int reach;    // 3 taps each way; no constant: an unrolled loop would run for empty texels too
uniform vec2 axis;
out vec4 blurred;

void main() {
    Texel t;
    blurred = vec4(0.0);
    if (!begin(t)) return;
    float texels = sigma / dot(t.mm, axis);
    vec3 sum = taps[reach] * t.own.rgb;
    for (int k = -reach; k <= reach; ++k)
        if (k != 0) sum += taps[k + reach] * tap(t, float(k) * texels * axis, abs(float(k)) * sigma);
    blurred = vec4(sum, 1.0);
}
