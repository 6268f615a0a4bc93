// Points that are listed one by one, a texel each: what a vertex shader would hand over, between the corners of a triangle.
uniform sampler2D point_list;   // triangle, and the weights of its corners
uniform sampler2D corner_list;  // of each triangle
uniform sampler2D vertex_list;  // eight texels a vertex, in the order of passes/surface.vert
uniform float point_mm;         // of the surface that a point stands for
vec3 world; vec3 local; vec3 world_normal; vec2 uv; vec4 a; vec4 b; mat3 light; float open_sky; vec3 sky; float scatters;
vec3 step_x; vec3 step_y; vec2 uv_x; vec2 uv_y;  // along two edges of the triangle, point_mm far

vec4 listed(sampler2D list, int k) { int width = textureSize(list, 0).x; return texelFetch(list, ivec2(k % width, k / width), 0); }

// False where the list has ended.
bool take_place() {
    vec4 point = texelFetch(point_list, ivec2(gl_FragCoord.xy), 0);
    if (point.x < 0.0) return false;
    ivec3 corners = ivec3(listed(corner_list, int(point.x)).xyz + 0.5);
    vec4 v[8];
    vec3 place[3]; vec2 at[3];
    for (int k = 0; k < 3; ++k) {
        vec4 first = listed(vertex_list, 8 * corners[k]);
        place[k] = (model * vec4(first.xyz, 1.0)).xyz;
        at[k] = listed(vertex_list, 8 * corners[k] + 1).zw;
    }
    step_x = place[1] - place[0]; step_y = place[2] - place[0];
    float x = point_mm / max(length(step_x), 1e-9), y = point_mm / max(length(step_y), 1e-9);
    step_x *= x; uv_x = x * (at[1] - at[0]);
    step_y *= y; uv_y = y * (at[2] - at[0]);
    for (int j = 0; j < 8; ++j) {
        v[j] = point.y * listed(vertex_list, 8 * corners.x + j) + point.z * listed(vertex_list, 8 * corners.y + j) + point.w * listed(vertex_list, 8 * corners.z + j);
    }
    local = v[0].xyz; world = (model * vec4(local, 1.0)).xyz; world_normal = mat3(model) * vec3(v[0].w, v[1].xy);
    uv = v[1].zw; a = v[2]; b = v[3]; light = mat3(v[4].xyz, vec3(v[4].w, v[5].xy), vec3(v[5].zw, v[6].x));
    open_sky = v[6].y; scatters = v[6].z; sky = vec3(v[6].w, v[7].xy);
    return true;
}
