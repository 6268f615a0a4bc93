// Of each tile of TILE x TILE pixels: the mean irradiance of its skin in the widest channel and the mean of its square, the share of skin, and
// of skin that the guard keeps from being averaged; and the skin's mean depth.
uniform sampler2D irradiance; uniform sampler2D depths; uniform sampler2D guarded;
uniform vec2 origin;  // of guarded in the picture, pixels
uniform vec3 widest;  // 1 for that channel
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 depth;  // x, mm

void main() {
    ivec2 from = TILE * ivec2(gl_FragCoord.xy), size = textureSize(irradiance, 0);
    light = vec4(0.0);
    depth = vec4(0.0);
    for (int k = 0; k < TILE * TILE; ++k) {
        ivec2 at = from + ivec2(k % TILE, k / TILE);
        if (any(greaterThanEqual(at, size))) continue;
        vec4 own = texelFetch(irradiance, at, 0);
        if (own.a < 0.5) continue;
        float e = dot(own.rgb, widest);
        light += vec4(e, e * e, 1.0, 1.0 - texelFetch(guarded, at - ivec2(origin), 0).a);
        depth.x += texelFetch(depths, at, 0).x;
    }
    float skin = max(light.z, 1.0);
    light = vec4(light.xy / skin, light.z / float(TILE * TILE), light.w / skin);
    depth.x /= skin;
}
