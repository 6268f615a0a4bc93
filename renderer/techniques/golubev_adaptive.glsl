// As many samples as the disc has pixels for, each found where it is taken.
#include "shaders/burley_disc.glsl"
uniform float distance_mm;        // d of the widest channel, by which radii are drawn
uniform int budget;
uniform float pixels_per_sample;

void main() {
    Pixel p;
    if (!begin(p)) return;
    float radius = filter_radius_mm * p.scale;
    int n = int(min(PI * radius * radius / pixels_per_sample, float(budget)));
    if (n < 1) return;
    Sum sum = Sum(vec3(0.0), vec3(0.0));
    for (int k = 0; k < n; ++k) {
        // Vuletic eq. 3.12 as corrected in docs/profiles.md: x of CDF(x) = 1 - u
        float u = 1.0 - (float(k) + 0.5) / float(n);
        float g = pow(1.0 + 4.0 * u * (2.0 * u + sqrt(1.0 + 4.0 * u * u)), 1.0 / 3.0);
        float x = 3.0 * log((1.0 + 1.0 / g + g) / (4.0 * u)), third = exp(-x / 3.0);
        float r = x * distance_mm, phi = 2.0 * PI * fract(float(k) * 0.618033988749895);
        gather(vec4(r * vec2(cos(phi), sin(phi)), r, distance_mm / (third * third * third + third)), p, sum);
    }
    scattered = resolve(p, sum);
    count.x = float(n);
}
