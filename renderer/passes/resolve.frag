// Supersampling resolved by a box filter in linear display light, sRGB, and half a step of ordered dither against banding.
#include "shaders/common.glsl"
#include "shaders/screen.glsl"
uniform sampler2D colour_map;
uniform int factor;
out vec4 pixel;
void main() {
    ivec2 base = ivec2(gl_FragCoord.xy) * factor;
    vec3 sum = vec3(0.0);
    for (int y = 0; y < factor; ++y) for (int x = 0; x < factor; ++x) sum += texelFetch(colour_map, base + ivec2(x, y), 0).rgb;
    vec3 encoded = to_srgb(sum / float(factor * factor));
    encoded += (interleaved_gradient_noise(image_pixel()) - 0.5) / 255.0;
    pixel = vec4(clamp(encoded, 0.0, 1.0), 1.0);
}
