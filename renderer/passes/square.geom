// A point as a square that faces the screen: splats, and how many of them cover a pixel.
layout(points) in;
layout(triangle_strip, max_vertices = 4) out;
uniform vec2 half_size;  // in normalised device coordinates
void main() {
    vec4 centre = gl_in[0].gl_Position;
    for (int k = 0; k < 4; ++k) {
        vec2 corner = vec2(k & 1, k >> 1) * 2.0 - 1.0;
        gl_Position = centre + vec4(corner * half_size * centre.w, 0.0, 0.0);
        EmitVertex();
    }
    EndPrimitive();
}
