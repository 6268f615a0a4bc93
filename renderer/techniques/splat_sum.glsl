// The sum of the splats; of near light, where it is normalised, over what light of 1 would have given; of far light what is kept.
uniform sampler2D near; uniform sampler2D arrived; uniform sampler2D far; uniform sampler2D irradiance; uniform sampler2D kept;
uniform int normalised;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 e = texelFetch(irradiance, here, 0), s = texelFetch(near, here, 0);
    vec3 n = texelFetch(arrived, here, 0).rgb;
    scattered = e;
    count = vec4(0.0, 0.0, 0.0, 1.0);
    if (e.a < 0.5) return;
    vec3 sum = s.rgb;
    // where no light of a channel arrives from any point the surface's own is what is known
    if (normalised == 1) sum = mix(e.rgb, s.rgb / max(n, 1e-12), greaterThan(n, vec3(1e-12)));
    scattered = vec4(sum + texelFetch(kept, here, 0).r * texelFetch(far, here, 0).rgb, 1.0);
    count.x = min(s.a, 60000.0);
}
