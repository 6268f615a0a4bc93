// What the surfaces are drawn over: the irradiance as it is, where nothing scatters.
uniform sampler2D irradiance;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;
void main() {
    scattered = texelFetch(irradiance, ivec2(gl_FragCoord.xy), 0);
    count = vec4(0.0, 0.0, 0.0, 1.0);
}
