// Optical depth of strands up to four distances behind the first one: Yuksel and Keyser 2008, doi:10.1111/j.1467-8659.2008.01165.x.
#include "shaders/deep.glsl"
in float depth_mm; in float opacity;
uniform sampler2DArray strand_depth;
uniform int index_of_layer;
uniform float depth_range;
layout(location = 0) out vec4 sums;
void main() {
    float first = texelFetch(strand_depth, ivec3(gl_FragCoord.xy, index_of_layer), 0).r * depth_range;
    float own = -log(1.0 - min(opacity, 0.95));
    sums = own * vec4(lessThanEqual(vec4(depth_mm - first), DEEP_MM));
    sums.w = own;
}
