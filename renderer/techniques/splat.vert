// A point on the surface with its light; one that nothing visible lies near is left out.
uniform sampler2D light; uniform sampler2D places; uniform sampler2D normals; uniform sampler2D depths;
uniform sampler2D about;  // mm2 that it stands for; mm of the object below it, 0 where that is of no account; the table's row
uniform mat4 view; uniform mat4 projection;
uniform float reach_mm;
out vec3 point_light; out vec3 point_at; out vec3 point_normal;  // irradiance; place and normal in view space
out vec4 point_about;
out float point_reach;  // mm, 0: left out

void main() {
    ivec2 texel = ivec2(gl_VertexID % textureSize(light, 0).x, gl_VertexID / textureSize(light, 0).x);
    vec4 e = texelFetch(light, texel, 0);
    vec4 q = view * vec4(texelFetch(places, texel, 0).xyz, 1.0);
    vec3 n = mat3(view) * texelFetch(normals, texel, 0).xyz;
    point_light = e.rgb; point_at = q.xyz; point_normal = n / max(length(n), 1e-6);
    point_about = texelFetch(about, texel, 0);
    gl_Position = projection * q;
    float depth = -q.z, reach = length(vec2(reach_mm, point_about.y));
    point_reach = e.a > 0.5 && depth > -reach ? reach : 0.0;
    if (point_reach > 0.0 && depth > 1.05 * reach) {
        // nine places over the square: is anything there that the point is not far behind?
        bool near = false;
        vec2 extent = reach * vec2(projection[0][0], projection[1][1]) / depth;
        for (int k = 0; k < 9; ++k) {
            vec2 at = gl_Position.xy / gl_Position.w + extent * vec2(k % 3 - 1, k / 3 - 1);
            if (any(greaterThan(abs(at), vec2(1.0)))) { near = true; continue; }
            float seen = texture(depths, at * 0.5 + 0.5).x;
            if (seen > 0.0 && depth < seen + reach) near = true;
        }
        if (!near) point_reach = 0.0;
    }
}
