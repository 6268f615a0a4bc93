// A tile's number of taps: the pixel itself and rings about it, each tap the mean over its part of the disc where the guard lets it be one.
#include "shaders/common.glsl"
#include "shaders/screen.glsl"
uniform sampler2D irradiance; uniform sampler2D depths;
uniform sampler2D guarded;     // with its levels of means
uniform vec2 origin;           // of these in the picture, pixels
uniform sampler2D chosen;      // a texel a tile
uniform sampler2D taps;        // two rows a rung: radius in mm, cosine, sine, binary logarithm of the side of the mean in mm; weights over the profile, least radius of depth in mm
uniform float firsts[SETS];    // where each set begins
uniform float on_ring[SETS];   // taps on each ring of it
uniform vec3 shape;            // 1 / d per channel, 1/mm
uniform float pixels_per_mm;
uniform float filter_radius_mm;
uniform float levels;          // of the pyramid
uniform float whole;           // the least share of a mean that the guard has to let in
uniform float jitter;          // 1: a rotation a block at random, 0: the same for all pixels
uniform float turn;            // of this frame, in turns
uniform int block;             // pixels that share a rotation, along one side
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;

// A mean spreads what it stands for by half its squared side, box and tent along both axes, and a pixel that is read bilinearly by a sixth
// (renderer/optics/rings.py).
const float TEXEL_VARIANCE = 0.5, PIXEL_VARIANCE = 1.0 / 6.0;
const float SMALLER = 2.0;     // levels
const float LOST = 0.5;     // pixels of each row of a mean that may be missing; a step of depth takes two
const float STEEPEST = 8.0;    // slope of depth; what is steeper is a silhouette

vec3 profile(float r) { vec3 third = exp(-shape * r / 3.0); return shape * (third * third * third + third) / r; }

// By how much a read between two levels spreads it, in squared pixels.
float spread_of(float level) {
    int low = int(level);
    float area = intBitsToFloat((127 + 2 * low) << 23);  // 4^low, by its exponent
    return mix(low < 1 ? PIXEL_VARIANCE : TEXEL_VARIANCE * area, TEXEL_VARIANCE * 4.0 * area, level - float(low));
}

// Which even part of the turn between two taps a pixel of a block takes.
float part_of_block(ivec2 within) {
    int all = block * block;
    return float(7 * (within.y * block + within.x) % all) / float(all);
}

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), last = textureSize(irradiance, 0) - 1;
    vec4 own = texelFetch(irradiance, at, 0);
    bool skin = own.a >= 0.5;
    scattered = vec4(own.rgb, skin ? 1.0 : 0.0);
    count = vec4(skin ? 1.0 : 0.0, 0.0, 0.0, 1.0);
    float depth = texelFetch(depths, at, 0).x, scale = pixels_per_mm / max(depth, 1e-3), pixel_mm = 1.0 / scale, log2_scale = log2(scale);
    vec2 slope = vec2(dFdx(depth), dFdy(depth)) * scale;
    if (!skin || filter_radius_mm * scale < 1.0) return;
    float narrower = max(abs(slope.x), abs(slope.y)) < STEEPEST ? -0.5 * log2(1.0 + dot(slope, slope)) : 0.0;
    vec4 tile = texelFetch(chosen, at / TILE, 0);
    int set = int(tile.x), first = int(firsts[set]), parts = block * block;
    ivec2 pixel = ivec2(image_pixel()), within = pixel % block;
    int row = 2 * (parts * clamp(int(tile.z), 0, textureSize(taps, 0).y / (2 * parts) - 1) + within.y * block + within.x);
    float noise = interleaved_gradient_noise(vec2(pixel / block) + 0.5);
    float start = 2.0 * PI * (jitter * (noise + part_of_block(within) / on_ring[set]) + turn);
    mat2 rotation = scale * mat2(cos(start), sin(start), -sin(start), cos(start));
    vec2 size = vec2(textureSize(irradiance, 0)), padded = vec2(textureSize(guarded, 0));
    vec4 weights = texelFetch(taps, ivec2(first, row + 1), 0);
    vec3 weight = weights.rgb * profile(weights.w);
    vec3 light = weight * own.rgb;  // the first tap is the pixel itself
    for (int k = first + 1; k < first + int(tile.y); ++k) {
        vec4 tap = texelFetch(taps, ivec2(k, row), 0);
        weights = texelFetch(taps, ivec2(k, row + 1), 0);
        vec2 towards = rotation * tap.yz, there;
        float fitted = max(tap.w + log2_scale, 0.0), level = clamp(fitted + narrower, 0.0, levels);
        float squared = tap.x * tap.x, whole_spread = squared + spread_of(fitted) * pixel_mm * pixel_mm;
        vec4 mean = vec4(0.0);
        bool averaged = false;
        for (int j = 0; j < SIZES && !averaged; ++j) {
            // what another side than the fitted one spreads more or less by comes off the radius or on it
            float side = exp2(level);
            there = gl_FragCoord.xy + sqrt(max(whole_spread - spread_of(level) * pixel_mm * pixel_mm, 0.04 * squared)) * towards;
            mean = textureLod(guarded, (there - origin) / padded, level);
            averaged = mean.a >= max(whole, 1.0 - LOST / side);
            level = max(level - SMALLER, 0.0);
        }
        if (!averaged) {
            there = gl_FragCoord.xy + sqrt(whole_spread) * towards;
            mean = texture(irradiance, (clamp(floor(there), vec2(0.0), size - 1.0) + 0.5) / size);
            if (mean.a < 0.5) continue;
            mean.a = 1.0;
        }
        float step = texture(depths, (clamp(floor(there), vec2(0.0), size - 1.0) + 0.5) / size).x - depth;
        vec3 w = weights.rgb * profile(sqrt(weights.w * weights.w + step * step));
        weight += w;
        light += w * mean.rgb / mean.a;
    }
    count.x = tile.y;
    scattered.rgb = mix(own.rgb, light / max(weight, 1e-12), greaterThan(weight, vec3(1e-8)));
}
