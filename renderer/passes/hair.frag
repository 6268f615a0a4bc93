// A ribbon of hair: what was shaded at its points, as opaque as it is wide.
in vec3 radiance; in float opacity;
layout(location = 0) out vec4 premultiplied;
void main() { premultiplied = vec4(radiance * opacity, opacity); }
