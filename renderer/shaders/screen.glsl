// Where a technique's pixel lies in the image: its textures hold the rows from first_row on, all of them or a piece.
uniform vec2 image_size;  // px
uniform float first_row;
vec2 image_pixel() { return gl_FragCoord.xy + vec2(0.0, first_row); }

// The texel at a place of the image, from 0 to 1; beyond the edges the last one.
vec4 texel_at(sampler2D map, vec2 place) {
    ivec2 at = ivec2(floor(place * image_size)) - ivec2(0, int(first_row));
    return texelFetch(map, clamp(at, ivec2(0), textureSize(map, 0) - 1), 0);
}
