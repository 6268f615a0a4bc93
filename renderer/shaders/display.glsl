// Linear display light to sRGB: a film's grain, and half a step of ordered dither against banding.
uniform float grain;  // standard deviation, of white
vec3 displayed(vec3 linear, vec2 pixel) {
    vec3 encoded = to_srgb(linear);
    if (grain > 0.0) {  // the sum of four even draws, nearly normal; a variance of 1 / 12 each
        uint h = hash3(ivec3(pixel, 61));
        float sum4 = unit(h) + unit(mix_bits(h ^ 1u)) + unit(mix_bits(h ^ 2u)) + unit(mix_bits(h ^ 3u)) - 2.0;
        encoded += grain * sum4 * 1.7320508 * sqrt(4.0 * encoded.g * (1.0 - encoded.g) + 0.05);
    }
    encoded += (interleaved_gradient_noise(pixel) - 0.5) / 255.0;
    return clamp(encoded, 0.0, 1.0);
}
