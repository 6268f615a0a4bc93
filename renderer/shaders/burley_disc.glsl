// One sample of Burley's disc in screen space (Golubev 2018), shared by golubev and golubev_plus.
#include "shaders/common.glsl"
#include "shaders/screen.glsl"
uniform sampler2D irradiance; uniform sampler2D depths;
uniform vec4 samples[SAMPLES];    // x, y, radius in mm; 1 / density
uniform vec3 shape;               // s = 1 / d per channel, 1/mm
uniform float pixels_per_mm;      // at 1 mm
uniform float filter_radius_mm;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;

struct Pixel { vec3 irradiance; float depth; vec2 at; vec2 size; float scale; mat2 turn; };
struct Sum { vec3 weight; vec3 light; };

// Sets up the pixel and the outputs as without scattering; false where it stays so: no skin, or a filter narrower than a pixel.
bool begin(out Pixel p) {
    vec4 centre = texelFetch(irradiance, ivec2(gl_FragCoord.xy), 0);
    bool skin = centre.a >= 0.5;
    scattered = vec4(centre.rgb, skin ? 1.0 : 0.0);
    count = vec4(skin ? 1.0 : 0.0, 0.0, 0.0, 1.0);
    p.irradiance = centre.rgb;
    p.depth = texelFetch(depths, ivec2(gl_FragCoord.xy), 0).x;
    p.at = image_pixel();
    p.size = image_size;
    p.scale = pixels_per_mm / max(p.depth, 1e-3);
    float angle = 2.0 * PI * interleaved_gradient_noise(image_pixel());
    p.turn = mat2(cos(angle), sin(angle), -sin(angle), cos(angle));
    return skin && filter_radius_mm * p.scale >= 1.0;
}

// Adds sample k; returns its irradiance and whether it lies on scattering material.
vec4 take(int k, Pixel p, inout Sum sum) {
    vec4 s = samples[k];
    vec2 there = (p.at + p.turn * s.xy * p.scale) / p.size;
    vec4 e = texel_at(irradiance, there);
    if (e.a < 0.5) return vec4(0.0);
    float dz = texel_at(depths, there).x - p.depth;
    float r = sqrt(s.z * s.z + dz * dz);
    vec3 third = exp(-shape * r / 3.0);
    vec3 w = shape * (third * third * third + third) * s.w;  // R(r') r' over R(r) r
#if SURFACE_WEIGHTS
    w *= s.z / r;  // R(r') over R(r): the disc's samples stand for equal areas of the surface
#endif
    sum.weight += w;
    sum.light += w * e.rgb;
    return vec4(e.rgb, 1.0);
}

vec4 resolve(Pixel p, Sum sum) {
    return vec4(mix(p.irradiance, sum.light / max(sum.weight, 1e-12), greaterThan(sum.weight, vec3(1e-8))), 1.0);
}
