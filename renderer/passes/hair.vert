// A strand as a ribbon that faces the camera: at least one pixel wide, the rest of its width in its opacity.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 tangent_in;
layout(location = 2) in vec4 strand;    // side -1 or 1, width mm, cover, along the strand 0..1
layout(location = 3) in vec3 albedo_in;
layout(location = 4) in vec3 environment_in;
layout(location = 5) in float number;    // of the point among all of its mesh
uniform mat4 view;
uniform mat4 projection;
uniform vec3 camera_position;
uniform float pixels_per_mm;   // at 1 mm
uniform float minimum_px;
uniform sampler2DArray lit_map; // what of each lamp's light reaches a point (passes/hair_lit.frag)
out vec3 world; out vec3 tangent; out vec3 albedo; out vec3 around; out float cover; out float opacity; out float lit[LAMPS];
void main() {
    vec3 to_eye = normalize(camera_position - position);
    vec3 across = cross(tangent_in, to_eye);
    across /= max(length(across), 1e-4);
    float depth = -(view * vec4(position, 1.0)).z;
    float width = strand.y * mix(1.0, 0.35, strand.w * strand.w);
    float pixels = width * pixels_per_mm / depth;
    float wide = max(pixels, minimum_px) * depth / pixels_per_mm;
    opacity = min(pixels / minimum_px, 1.0);
    world = position + across * strand.x * 0.5 * wide;
    tangent = tangent_in; albedo = albedo_in; around = environment_in; cover = strand.z;
    int columns = textureSize(lit_map, 0).x, point = int(number);
    for (int k = 0; k < LAMPS; ++k) lit[k] = texelFetch(lit_map, ivec3(point % columns, point / columns, k), 0).r;
    gl_Position = projection * view * vec4(world, 1.0);
}
