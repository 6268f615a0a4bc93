// One frame's share of a mean, drawn with additive blending.
uniform sampler2D light; uniform sampler2D counted;
uniform float share;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;
void main() {
    scattered = share * texelFetch(light, ivec2(gl_FragCoord.xy), 0);
    count = share * texelFetch(counted, ivec2(gl_FragCoord.xy), 0);
}
