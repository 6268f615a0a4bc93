layout(location = 0) in vec3 position;
uniform mat4 lamp;
out float depth_mm;
void main() {
    vec4 q = lamp * vec4(position, 1.0);
    depth_mm = q.z;
    gl_Position = vec4(q.xy, q.z / 1000.0 - 1.0, 1.0);  // the box is at most 2 m deep
}
