// What a weighted sum of blurs starts from: a share of the light itself, all of it where nothing scatters.
uniform sampler2D light;
uniform vec3 unblurred; uniform float samples;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;
void main() {
    vec4 e = texelFetch(light, ivec2(gl_FragCoord.xy), 0);
    bool scatters = e.a > 0.5;
    scattered = vec4(scatters ? unblurred * e.rgb : e.rgb, scatters ? 1.0 : 0.0);
    count = vec4(scatters ? samples : 0.0, 0.0, 0.0, 1.0);
}
