// Every sample for every pixel.
#include "shaders/burley_disc.glsl"
void main() {
    Pixel p;
    if (!begin(p)) return;
    Sum sum = Sum(vec3(0.0), vec3(0.0));
    for (int k = 0; k < SAMPLES; ++k) take(k, p, sum);
    scattered = resolve(p, sum);
    count.x = float(SAMPLES);
}
