// Transmitted light joins the irradiance before it is scattered (Jimenez 2010); not shadowed.
uniform sampler2D irradiance; uniform sampler2D transmitted;
layout(location = 0) out vec4 total;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 e = texelFetch(irradiance, at, 0);
    total = vec4(e.rgb + e.a * texelFetch(transmitted, at, 0).rgb, e.a);
}
