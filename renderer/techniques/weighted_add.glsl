// One more blur of a weighted sum, drawn with additive blending; its alpha is 1 where the medium scatters.
uniform sampler2D source;
uniform vec3 weight;
layout(location = 0) out vec4 added;
layout(location = 1) out vec4 count;
void main() {
    vec4 e = texelFetch(source, ivec2(gl_FragCoord.xy), 0);
    added = vec4(e.a * weight * e.rgb, 0.0);
    count = vec4(0.0);
}
