// The filtered light of the atlas where its surface is seen: between texels linearly, and where they are long by a cubic
// B-spline, since the straight ramps of an edge that crosses long texels aslant would be seen as teeth.
in vec2 uv;
uniform sampler2D filtered; uniform sampler2D irradiance;
uniform sampler2D texel_mm;
uniform float coarse_mm;  // from here the spline begins to take over, it does so wholly at half as much again
uniform float taps;
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;

// By four looks between texels (Sigg and Hadwiger 2005, GPU Gems 2, ch. 20).
vec4 spline(vec2 at) {
    vec2 size = vec2(textureSize(filtered, 0)), p = at * size - 0.5, f = fract(p), i = floor(p);
    vec2 f2 = f * f, f3 = f2 * f;
    vec2 w0 = (1.0 - 3.0 * f + 3.0 * f2 - f3) / 6.0, w1 = (4.0 - 6.0 * f2 + 3.0 * f3) / 6.0, w3 = f3 / 6.0;
    vec2 low = w0 + w1, high = 1.0 - low;
    vec2 a = (i - 0.5 + w1 / low) / size, b = (i + 1.5 + w3 / high) / size;
    return low.y * (low.x * texture(filtered, a) + high.x * texture(filtered, vec2(b.x, a.y)))
         + high.y * (low.x * texture(filtered, vec2(a.x, b.y)) + high.x * texture(filtered, b));
}

void main() {
    vec4 e = texelFetch(irradiance, ivec2(gl_FragCoord.xy), 0);
    if (e.a < 0.5) discard;
    vec2 mm = texture(texel_mm, uv).xy;
    float coarse = smoothstep(coarse_mm, 1.5 * coarse_mm, max(mm.x, mm.y));
    vec4 light = texture(filtered, uv);
    if (coarse > 0.0) light = mix(light, spline(uv), coarse);
    scattered = vec4(light.a > 0.0 ? light.rgb / light.a : e.rgb, 1.0);
    count = vec4(taps, 0.0, 0.0, 1.0);
}
