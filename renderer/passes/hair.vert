// A point of a strand as two corners of a ribbon that faces the camera or a lamp: at least minimum_px wide, and as opaque as its own
// width's share of that, so that what a thin strand covers is right at every distance. Points are read by their number.
uniform sampler2D places;      // xyz: mm in the world, w: width in mm
uniform sampler2D tangents;    // xyz: unit, w: number of the strand
uniform mat4 matrix;           // world to clip space
uniform vec2 drawn_size;       // pixels
uniform float minimum_px;
uniform float widened;         // widths are multiplied by this: a strand stands for several
out float opacity;
#if LAMP
out float depth_mm;
#else
uniform sampler2D radiances;   // of points, towards the camera (passes/hair_shade.frag)
out vec3 radiance;
#endif
void main() {
    int point = gl_VertexID >> 1, columns = textureSize(places, 0).x;
    ivec2 at = ivec2(point % columns, point / columns);
    vec4 place = texelFetch(places, at, 0);
    vec4 here = matrix * vec4(place.xyz, 1.0), step_on = matrix * vec4(texelFetch(tangents, at, 0).xyz, 0.0);
    vec2 along = (step_on.xy * here.w - here.xy * step_on.w) * drawn_size;
    float reach = length(along);
    vec2 across = reach > 1e-9 ? vec2(-along.y, along.x) / reach : vec2(1.0, 0.0);
    float scale = length(vec3(matrix[0].x, matrix[1].x, matrix[2].x)) * 0.5 * drawn_size.x / here.w;  // pixels a mm
    float pixels = place.w * widened * scale, wide = max(pixels, minimum_px);
    opacity = pixels / wide;
    vec2 moved = here.xy + here.w * across * (gl_VertexID % 2 == 0 ? -1.0 : 1.0) * wide / drawn_size;
#if LAMP
    depth_mm = here.z;
    gl_Position = vec4(moved, 0.0, here.w);
#else
    radiance = texelFetch(radiances, at, 0).rgb;
    gl_Position = vec4(moved, here.zw);
#endif
}
