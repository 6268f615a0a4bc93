// Supersampling resolved by a box filter in linear display light, sRGB, and half a step of ordered dither against banding.
#include "shaders/common.glsl"
#include "shaders/screen.glsl"
uniform sampler2D colour_map;
uniform int factor;
uniform float grain;  // standard deviation, of white
out vec4 pixel;
void main() {
    ivec2 base = ivec2(gl_FragCoord.xy) * factor;
    vec3 sum = vec3(0.0);
    for (int y = 0; y < factor; ++y) for (int x = 0; x < factor; ++x) sum += texelFetch(colour_map, base + ivec2(x, y), 0).rgb;
    vec3 encoded = to_srgb(sum / float(factor * factor));
    if (grain > 0.0) {  // the sum of four even draws, nearly normal; a variance of 1 / 12 each
        uint h = hash3(ivec3(image_pixel(), 61));
        float sum4 = unit(h) + unit(mix_bits(h ^ 1u)) + unit(mix_bits(h ^ 2u)) + unit(mix_bits(h ^ 3u)) - 2.0;
        encoded += grain * sum4 * 1.7320508 * sqrt(4.0 * encoded.g * (1.0 - encoded.g) + 0.05);
    }
    encoded += (interleaved_gradient_noise(image_pixel()) - 0.5) / 255.0;
    pixel = vec4(clamp(encoded, 0.0, 1.0), 1.0);
}
