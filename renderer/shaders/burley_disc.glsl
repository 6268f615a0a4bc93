// Samples of Burley's disc in screen space (Golubev 2018), shared by the techniques that take them.
#include "shaders/rotation.glsl"
uniform sampler2D irradiance; uniform sampler2D depths;
uniform vec3 shape;               // s = 1 / d per channel, 1/mm
uniform float pixels_per_mm;      // at 1 mm
uniform float filter_radius_mm;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;

struct Pixel { vec3 irradiance; float depth; vec2 at; vec2 size; float scale; mat2 turn; vec3 place; vec3 tangent; vec3 bitangent; };
struct Sum { vec3 weight; vec3 light; };

// Where a pixel's surface lies in view space, mm; z is depth.
vec3 in_view(vec2 at, vec2 size, float depth) { return vec3((at - 0.5 * size) * depth / pixels_per_mm, depth); }

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
    p.turn = rotation();
#if TANGENT_DISC
    p.place = in_view(p.at, p.size, p.depth);
    vec3 n = cross(dFdx(p.place), dFdy(p.place));
    // across a silhouette the difference is no surface's: there, and where n is not known, the disc faces the camera
    bool known = abs(dot(n, p.place)) > 0.1 * length(n) * length(p.place);
    n = known ? normalize(n) * -sign(n.z) : vec3(0.0, 0.0, -1.0);
    float a = -1.0 / (1.0 - n.z);  // a frame about n, n.z < 0: Duff et al. 2017, "Building an orthonormal basis, revisited"
    p.tangent = vec3(1.0 + a * n.x * n.x, a * n.x * n.y, n.x);
    p.bitangent = vec3(a * n.x * n.y, 1.0 + a * n.y * n.y, n.y);
#endif
    return skin && filter_radius_mm * p.scale >= 1.0;
}

// Adds a sample (x, y and radius in mm; 1 / density); returns its irradiance and whether it lies on scattering material.
vec4 gather(vec4 s, Pixel p, inout Sum sum) {
#if TANGENT_DISC
    vec2 on_disc = p.turn * s.xy;
    vec3 point = p.place + on_disc.x * p.tangent + on_disc.y * p.bitangent;
    vec2 there = (point.xy * pixels_per_mm / max(point.z, 1e-3)) / p.size + 0.5;
#else
    vec2 there = (p.at + p.turn * s.xy * p.scale) / p.size;
#endif
    vec4 e = texel_at(irradiance, there);
    if (e.a < 0.5) return vec4(0.0);
    float depth = texel_at(depths, there).x;
#if TANGENT_DISC
    float r = max(distance(in_view(there * p.size, p.size, depth), p.place), 1e-4);
#else
    float dz = depth - p.depth;
    float r = sqrt(s.z * s.z + dz * dz);
#endif
    vec3 third = exp(-shape * r / 3.0);
    vec3 w = shape * (third * third * third + third) * s.w;  // R(r') r' over R(r) r
#if SURFACE_WEIGHTS
    w *= s.z / r;  // R(r') over R(r): the disc's samples stand for equal areas of the surface
#endif
    sum.weight += w;
    sum.light += w * e.rgb;
    return vec4(e.rgb, 1.0);
}

#ifdef SAMPLES
uniform vec4 samples[SAMPLES];
vec4 take(int k, Pixel p, inout Sum sum) { return gather(samples[k], p, sum); }
#endif

vec4 resolve(Pixel p, Sum sum) {
    return vec4(mix(p.irradiance, sum.light / max(sum.weight, 1e-12), greaterThan(sum.weight, vec3(1e-8))), 1.0);
}
