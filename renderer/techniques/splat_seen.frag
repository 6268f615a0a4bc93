// The normals of the surfaces to which splats may bring light, where they are seen; alpha 1 there.
in vec3 world_normal;
layout(location = 0) out vec4 seen;
void main() { seen = vec4(normalize(world_normal), 1.0); }
