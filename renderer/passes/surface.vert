// A surface placed over a domain: the screen or its own texture atlas (points: passes/points.glsl).
#include "passes/domain.glsl"
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texture_uv;
layout(location = 3) in vec4 mask_a;
layout(location = 4) in vec4 mask_b;
layout(location = 5) in vec3 light_r;  // vector irradiance per channel, in the world: E(n) = max(0, light . n)
layout(location = 6) in vec3 light_g;
layout(location = 7) in vec3 light_b;
layout(location = 8) in vec2 openness;  // share of open sky; 1 where the material scatters
layout(location = 9) in vec3 sky_in;    // mean direction in which the sky is open, in the world
uniform mat4 model;                     // object to world
uniform mat4 view;
uniform mat4 projection;
out vec3 world; out vec3 local; out vec3 world_normal; out vec2 uv; out vec4 a; out vec4 b; out mat3 light; out float open_sky; out vec3 sky; out float scatters;
out float view_depth;
invariant gl_Position;
void main() {
    vec4 p = model * vec4(position, 1.0), q = view * p;
    world = p.xyz; local = position; world_normal = mat3(model) * normal; uv = texture_uv; a = mask_a; b = mask_b;
    light = mat3(light_r, light_g, light_b);
    open_sky = openness.x;
    sky = sky_in;
    scatters = openness.y;
    view_depth = -q.z;
#if DOMAIN == SCREEN
    gl_Position = projection * q;
#else
    gl_Position = vec4(texture_uv * 2.0 - 1.0, 0.0, 1.0);
#endif
}
