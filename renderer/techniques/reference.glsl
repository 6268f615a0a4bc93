// What the walks bring, where the medium scatters; elsewhere the light as it is.
uniform sampler2D irradiance; uniform sampler2D walked;
uniform float walks;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    scattered = texelFetch(irradiance, at, 0);
    count = vec4(0.0);
    if (scattered.a < 0.5) return;
    scattered.rgb = texelFetch(walked, at, 0).rgb;
    count.x = walks;
}
