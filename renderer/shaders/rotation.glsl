// By how much a pixel turns its samples: at random from pixel to pixel, and by `turn` from frame to frame (renderer/techniques/rotated.py).
#include "shaders/common.glsl"
#include "shaders/screen.glsl"
uniform float jitter;  // 1: a random rotation a pixel, 0: the same for all
uniform float turn;    // of this frame, in turns
mat2 rotation() {
    float angle = 2.0 * PI * (jitter * interleaved_gradient_noise(image_pixel()) + turn);
    return mat2(cos(angle), sin(angle), -sin(angle), cos(angle));
}
