// Every sample for every pixel.
#include "shaders/burley_disc.glsl"
void main() {
    vec4 centre = texelFetch(irradiance, ivec2(gl_FragCoord.xy), 0);
    scattered = vec4(centre.rgb, 0.0);
    count = vec4(0.0, 0.0, 0.0, 1.0);
    if (centre.a < 0.5) return;
    Pixel p = centre_pixel(centre);
    scattered = vec4(centre.rgb, 1.0);
    count.x = 1.0;
    if (filter_radius_mm * p.scale < 1.0) return;  // narrower than a pixel: the diffuse BRDF
    Sum sum = Sum(vec3(0.0), vec3(0.0));
    for (int k = 0; k < SAMPLES; ++k) take(k, p, sum);
    scattered = resolve(p, sum);
    count.x = float(SAMPLES);
}
