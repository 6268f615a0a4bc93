// How light passes a rough face on its way to the medium and back (renderer/optics/surface.py).
#define LAMBERT 0
#define DISNEY 1
#define CONSERVING 2
#ifndef DIFFUSE
#define DIFFUSE LAMBERT
#endif
uniform sampler2D face_table;  // rows: roughness .05 to 1; columns: cosine 0 to 1, and the mean over all directions

vec3 face_at(float column, float m) {
    vec2 n = vec2(textureSize(face_table, 0));
    float row = clamp((m - 0.05) / 0.95, 0.0, 1.0) * (n.y - 1.0) + 0.5;
    return texture(face_table, vec2(column / n.x, row / n.y)).xyz;
}
vec3 face(float cosine, float m) {
    float n = float(textureSize(face_table, 0).x) - 1.0;
    return face_at(clamp(cosine * n, 0.5, n - 0.5), m);
}
vec3 face_even(float m) { return face_at(float(textureSize(face_table, 0).x) - 0.5, m); }
