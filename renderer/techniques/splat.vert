// A point on the surface with its light; one that nothing visible lies near is left out.
uniform sampler2D light; uniform sampler2D places; uniform sampler2D depths;
uniform mat4 view; uniform mat4 projection;
uniform float reach_mm;
out vec3 point_light; out vec3 point_at;  // irradiance; place in view space, mm
out float point_kept;

void main() {
    ivec2 texel = ivec2(gl_VertexID % textureSize(light, 0).x, gl_VertexID / textureSize(light, 0).x);
    vec4 e = texelFetch(light, texel, 0);
    vec4 q = view * vec4(texelFetch(places, texel, 0).xyz, 1.0);
    point_light = e.rgb; point_at = q.xyz;
    gl_Position = projection * q;
    float depth = -q.z;
    point_kept = e.a > 0.5 && depth > reach_mm ? 1.0 : 0.0;
    if (point_kept > 0.5) {
        // nine places over the square: is anything there that the point is not far behind?
        bool near = false;
        vec2 extent = reach_mm * vec2(projection[0][0], projection[1][1]) / depth;
        for (int k = 0; k < 9; ++k) {
            vec2 at = gl_Position.xy / gl_Position.w + extent * vec2(k % 3 - 1, k / 3 - 1);
            if (any(greaterThan(abs(at), vec2(1.0)))) { near = true; continue; }
            float seen = texture(depths, at * 0.5 + 0.5).x;
            if (seen > 0.0 && depth < seen + reach_mm) near = true;
        }
        if (!near) point_kept = 0.0;
    }
}
