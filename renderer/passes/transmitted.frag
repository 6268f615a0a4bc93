// What comes through the surfaces that scatter, for one way to reckon it; over what is drawn already.
#include "shaders/common.glsl"
#include "shaders/lighting.glsl"
#include "passes/transmission.glsl"
#include "passes/lids.glsl"
in vec3 world; in vec3 local; in vec3 world_normal; in vec4 a; in vec4 b; in float scatters;
out vec4 through;
void main() {
    vec3 n = normalize(world_normal);
    if (dot(n, camera_position - world) < 0.0 && !gl_FrontFacing) n = -n;
    vec3 total = vec3(0.0);
    for (int k = 0; k < lamps; ++k) total += transmitted(k, world, n);
    through = vec4(total * step(0.5, scatters) * through_flesh(local, a.x, b.w), 1.0);
}
