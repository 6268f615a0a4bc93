// A point as a square that faces the screen and covers the sphere of its reach.
layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
uniform mat4 projection;
uniform sampler2D near_total;
in vec3 point_light[]; in vec3 point_at[]; in vec3 point_normal[]; in vec4 point_about[]; in float point_reach[];
flat out vec3 own_light; flat out vec3 own_at; flat out vec3 own_normal; flat out vec4 own_about; flat out vec3 own_total;

void main() {
    float reach = point_reach[0];
    if (reach <= 0.0) return;
    vec3 c = point_at[0], total = texture(near_total, vec2(0.5, point_about[0].z)).rgb;
    // seen from the side, a sphere is wider than its radius: r d / sqrt(d^2 - r^2)
    bool around = -c.z <= 1.05 * reach;  // the camera: the whole picture
    float d = length(c), wide = reach * d / sqrt(max(d * d - reach * reach, 1e-6 * d * d));
    for (int k = 0; k < 4; ++k) {
        vec2 corner = vec2(k & 1, k >> 1) * 2.0 - 1.0;
        own_light = point_light[0]; own_at = c; own_normal = point_normal[0]; own_about = point_about[0]; own_total = total;
        gl_Position = around ? vec4(corner, 0.0, 1.0) : projection * vec4(c.xy + corner * wide, c.z, 1.0);
        EmitVertex();
    }
    EndPrimitive();
}
