// What the shading of any surface hands to the rest.
#include "passes/domain.glsl"
layout(location = 0) out vec4 out_irradiance;    // rgb: E, alpha: the id of the material that scatters, 0 for none
layout(location = 1) out vec4 out_specular;      // rgb: radiance added after scattering
layout(location = 2) out vec4 out_albedo;        // rgb: diffuse albedo, alpha: the share of it that gets out, not sent back
layout(location = 3) out vec4 out_depth;  // screen: view depth in mm; else: normal in the world
#if DOMAIN != SCREEN
layout(location = 4) out vec4 out_transmitted;   // rgb: irradiance that comes through from behind
layout(location = 5) out vec4 out_position;      // xyz: mm in the world, alpha 1
#endif
uniform mat4 model;
#if DOMAIN == POINTS
#include "passes/points.glsl"
#else
in vec3 world; in vec3 local; in vec3 world_normal; in vec2 uv; in vec4 a; in vec4 b; in mat3 light; in float open_sky; in float scatters;
in vec3 sky;
in float view_depth;
#endif

// Millimetres that a fragment covers: relief finer than that fades out. Maps are read by `map_at`: a point's
// neighbours in the target are not its neighbours on the surface.
#if DOMAIN == POINTS
#define map_at(map, at) textureGrad(map, at, uv_x, uv_y)
float footprint_mm() { return point_mm; }
#else
#define map_at(map, at) texture(map, at)
#define step_x dFdx(world)
#define step_y dFdy(world)
#define uv_x dFdx(uv)
#define uv_y dFdy(uv)
float footprint_mm() {
    vec2 px = vec2(length(dFdx(world)), length(dFdy(world)));
    return max(min(px.x, px.y), 1e-3);
}
#endif

void put_place(vec3 n) {
#if DOMAIN == SCREEN
    out_depth = vec4(view_depth);
#else
    out_depth = vec4(n, 1.0);
    out_position = vec4(world, 1.0);
#endif
}
