// The sum of the splats, over what light of 1 would have given where it is normalised.
uniform sampler2D sent; uniform sampler2D arrived; uniform sampler2D irradiance;
uniform int normalised;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 e = texelFetch(irradiance, here, 0), s = texelFetch(sent, here, 0), n = texelFetch(arrived, here, 0);
    scattered = e;
    count = vec4(0.0, 0.0, 0.0, 1.0);
    if (e.a < 0.5) return;
    vec3 sum = s.rgb;
    // where no light of a channel arrives from any point the surface's own is what is known
    if (normalised == 1) sum = mix(e.rgb, s.rgb / max(n.rgb, 1e-12), greaterThan(n.rgb, vec3(1e-12)));
    scattered = vec4(sum, 1.0);
    count.x = min(n.a, 60000.0);
}
