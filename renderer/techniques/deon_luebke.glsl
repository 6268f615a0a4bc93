// One axis of one Gaussian over the atlas; along v also the weighted sum so far.
#include "techniques/atlas_tap.glsl"
uniform sampler2D sum_so_far;
uniform float taps[7];
uniform float sigma;  // mm, incremental
uniform int reach;    // 3 taps each way; no constant: an unrolled loop would run for empty texels too
uniform vec2 axis; uniform vec3 weight; uniform vec3 sum_scale;
layout(location = 0) out vec4 blurred;
layout(location = 1) out vec4 total;

void main() {
    Texel t;
    blurred = total = vec4(0.0);
    if (!begin(t)) return;
    float texels = sigma / dot(t.mm, axis);
    vec3 sum = taps[reach] * t.own.rgb;
    for (int k = -reach; k <= reach; ++k)
        if (k != 0) sum += taps[k + reach] * tap(t, float(k) * texels * axis, abs(float(k)) * sigma);
    blurred = vec4(sum, 1.0);
    total = vec4(sum_scale * texelFetch(sum_so_far, ivec2(gl_FragCoord.xy), 0).rgb + weight * sum, 1.0);
}
