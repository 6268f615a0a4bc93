// The filtered light of the atlas where its surface is seen.
in vec2 uv;
uniform sampler2D filtered; uniform sampler2D irradiance;
uniform float taps;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;
void main() {
    vec4 e = texelFetch(irradiance, ivec2(gl_FragCoord.xy), 0);
    if (e.a < 0.5) discard;
    vec4 light = texture(filtered, uv);
    scattered = vec4(light.a > 0.0 ? light.rgb / light.a : e.rgb, 1.0);
    count = vec4(taps, 0.0, 0.0, 1.0);
}
