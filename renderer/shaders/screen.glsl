// Where a technique's pixel lies in the image: its textures hold the rows from first_row on, all of them or a piece.
uniform vec2 image_size;  // px
uniform float first_row;
vec2 image_pixel() { return gl_FragCoord.xy + vec2(0.0, first_row); }

// The texel at a place of the image, from 0 to 1; beyond the edges the last one. Looked up at its own middle, so that a piece finds the one
// that the whole image does; texelFetch takes software drivers a third longer.
vec4 texel_at(sampler2D map, vec2 place) {
    vec2 middle = floor(place * image_size) + vec2(0.5, 0.5 - first_row);
    return texture(map, middle / vec2(textureSize(map, 0)));
}
