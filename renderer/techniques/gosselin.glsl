// One Poisson blur of the light map: twelve taps and their middle, all of one weight (eq. 13).
#include "techniques/atlas_tap.glsl"
uniform vec2 offsets[12];  // mm
uniform int taps;  // 12; no constant: an unrolled loop would run for empty texels too
uniform sampler2D kernel_map;    // grey, over the same texture coordinates
uniform float has_kernel_map;    // 1 or 0: white everywhere
uniform vec2 kernel_scale;       // of the radius: x times the map, and y (eq. 12)
out vec4 blurred;

void main() {
    Texel t;
    blurred = vec4(0.0);
    if (!begin(t)) return;
    vec3 sum = t.own.rgb;
    float painted = mix(1.0, textureLod(kernel_map, t.uv, 0.0).r, has_kernel_map);
    float size = kernel_scale.x * painted + kernel_scale.y;
    for (int k = 0; k < taps; ++k) sum += tap(t, size * offsets[k] / t.mm, size * length(offsets[k]));
    blurred = vec4(sum / float(taps + 1), 1.0);
}
