// A surface as a lamp sees it.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec2 texture_uv;
uniform mat4 model;
uniform mat4 layer;
uniform float depth_range;
out vec3 where; out vec3 facing;
void main() {
    vec4 q = layer * (model * vec4(position, 1.0));
    where = vec3(texture_uv, q.z);
    facing = mat3(model) * normal;
    gl_Position = vec4(q.xy, (2.0 * q.z / depth_range - 1.0) * q.w, q.w);  // linear in depth, after the division
}
