// One medium's scattered light into the light of all: other pixels keep what they have.
uniform sampler2D irradiance; uniform sampler2D scattered; uniform sampler2D count;
uniform float medium;
uniform int first_row;  // of the scattered light, in the irradiance
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 counted;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    if (abs(texelFetch(irradiance, at + ivec2(0, first_row), 0).a - medium) > 0.5) discard;
    light = texelFetch(scattered, at, 0);
    counted = texelFetch(count, at, 0);
}
