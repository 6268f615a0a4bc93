// What a translucent shadow map holds: place in the atlas, depth in mm, and which way the surface faces there.
in vec3 where; in vec3 facing;
layout(location = 0) out vec4 entry;
layout(location = 1) out vec4 entry_normal;
void main() {
    entry = vec4(where, 1.0);
    entry_normal = vec4(normalize(facing), 1.0);
}
