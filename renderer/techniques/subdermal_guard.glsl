// Irradiance of skin where it may be averaged, and in alpha whether it may: all four neighbours are skin, and none of them a step of depth away.
// Its levels of means then hold the light and the share of what may be averaged.
uniform sampler2D irradiance; uniform sampler2D depths;
uniform float pixels_per_mm;
uniform float step_px;  // pixel widths of depth that are a step
uniform vec2 origin;    // of what is drawn, in the picture, pixels
out vec4 guarded;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) + ivec2(origin), last = textureSize(irradiance, 0) - 1;
    guarded = vec4(0.0);
    if (any(greaterThan(at, last))) return;  // beyond the picture, where the pyramid is padded
    vec4 own = texelFetch(irradiance, at, 0);
    if (own.a < 0.5) return;
    float depth = texelFetch(depths, at, 0).x, limit = step_px * depth / pixels_per_mm;
    const ivec2 NEXT[4] = ivec2[4](ivec2(1, 0), ivec2(-1, 0), ivec2(0, 1), ivec2(0, -1));
    for (int k = 0; k < 4; ++k) {
        ivec2 there = clamp(at + NEXT[k], ivec2(0), last);
        if (texelFetch(irradiance, there, 0).a < 0.5 || abs(texelFetch(depths, there, 0).x - depth) > limit) return;
    }
    guarded = vec4(own.rgb, 1.0);
}
