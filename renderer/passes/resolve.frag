// Supersampling resolved by a box filter in linear display light; shown at once, or left for the lens.
#include "shaders/common.glsl"
#include "shaders/screen.glsl"
#include "shaders/display.glsl"
uniform sampler2D colour_map;
uniform int factor;
uniform float linear;  // 1: left as it is
out vec4 pixel;
void main() {
    ivec2 base = ivec2(gl_FragCoord.xy) * factor;
    vec3 sum = vec3(0.0);
    for (int y = 0; y < factor; ++y) for (int x = 0; x < factor; ++x) sum += texelFetch(colour_map, base + ivec2(x, y), 0).rgb;
    sum /= float(factor * factor);
    pixel = vec4(linear > 0.0 ? sum : displayed(sum, image_pixel()), 1.0);
}
