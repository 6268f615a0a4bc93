// A point as a square that faces the screen and covers the sphere of its reach.
layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
uniform mat4 projection;
uniform float reach_mm;
in vec3 point_light[]; in vec3 point_at[]; in float point_kept[];
flat out vec3 own_light; flat out vec3 own_at;

void main() {
    if (point_kept[0] < 0.5) return;
    vec3 c = point_at[0];
    // seen from the side, a sphere is wider than its radius: r d / sqrt(d^2 - r^2)
    float d = length(c), wide = reach_mm * d / sqrt(max(d * d - reach_mm * reach_mm, 1e-6 * d * d));
    for (int k = 0; k < 4; ++k) {
        vec2 corner = vec2(k & 1, k >> 1) * 2.0 - 1.0;
        own_light = point_light[0]; own_at = c;
        gl_Position = projection * vec4(c.xy + corner * wide, c.z, 1.0);
        EmitVertex();
    }
    EndPrimitive();
}
