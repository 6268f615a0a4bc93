// What reaches a point, averaged with the points beside it on its strand: maps have steps, and strands few points.
uniform sampler2D raw;       // (passes/hair_lit.frag)
uniform sampler2D tangents;  // w: number of the strand
layout(location = 0) out vec2 lit;

ivec2 place(int point, int columns) { return ivec2(point % columns, point / columns); }
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), size = textureSize(raw, 0);
    int point = at.y * size.x + at.x;
    float strand = texelFetch(tangents, at, 0).w;
    vec3 sum = 2.0 * vec3(texelFetch(raw, at, 0).rg, 1.0);
    for (int step_on = -1; step_on <= 1; step_on += 2) {
        int other = clamp(point + step_on, 0, size.x * size.y - 1);
        ivec2 there = place(other, size.x);
        if (other != point && texelFetch(tangents, there, 0).w == strand) sum += vec3(texelFetch(raw, there, 0).rg, 1.0);
    }
    lit = sum.xy / sum.z;
}
