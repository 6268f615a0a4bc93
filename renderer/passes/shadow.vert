// A surface or a ribbon of hair in a layer of a lamp's shadow map.
layout(location = 0) in vec3 position;
uniform mat4 model;
uniform mat4 layer;
uniform float depth_range;
out float depth_mm;
void main() {
    vec4 q = layer * (model * vec4(position, 1.0));
    depth_mm = q.z;
    gl_Position = vec4(q.xy, (2.0 * q.z / depth_range - 1.0) * q.w, q.w);  // linear in depth, after the division
}
