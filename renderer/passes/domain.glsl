// Where a surface is drawn.
#define SCREEN 0
#define ATLAS 1
#define POINTS 2
#ifndef DOMAIN
#define DOMAIN SCREEN
#endif
#if DOMAIN == POINTS
uniform ivec2 points_size;  // of the texture that holds a texel a point, row by row
vec4 point_place(int k) {
    vec2 texel = vec2(k % points_size.x, k / points_size.x) + 0.5;
    return vec4(texel / vec2(points_size) * 2.0 - 1.0, 0.0, 1.0);
}
#endif
