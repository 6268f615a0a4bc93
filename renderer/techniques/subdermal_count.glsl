// Which set of taps the pixels of a tile take: by the spread of irradiance about it, and by how much of the skin there cannot be averaged.
uniform sampler2D tiles; uniform sampler2D tile_depths;
uniform float pixels_per_mm;
uniform float sigma_mm;     // of the Gaussian of the neighbourhood
uniform vec3 by;            // taps: of every pixel, by the spread, by the share without guard
uniform float by_size;      // taps: where a pixel is as large as the widest distance
uniform float widest_mm;    // that distance
uniform float full_spread;  // from this spread on that share counts in full
uniform float counts[SETS];
uniform vec2 ladder;        // the first rung of the sizes of a pixel, and the logarithm of their ratio
out vec4 chosen;            // number of the set, its taps, rung counted from the first
const int FARTHEST = 8;     // tiles

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy), size = textureSize(tiles, 0);
    chosen = vec4(0.0);
    if (texelFetch(tiles, at, 0).z <= 0.0) return;
    float pixel_mm = texelFetch(tile_depths, at, 0).x / pixels_per_mm;
    float sigma = max(sigma_mm / (float(TILE) * pixel_mm), 0.5);  // tiles
    int reach = min(int(ceil(2.5 * sigma)), FARTHEST);
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
            ivec2 there = at + ivec2(x, y);
            if (any(lessThan(there, ivec2(0))) || any(greaterThanEqual(there, size))) continue;
            vec4 tile = texelFetch(tiles, there, 0);
            float w = exp(-0.5 * float(x * x + y * y) / (sigma * sigma)) * tile.z;
            sum += w * tile;
            total += w;
        }
    }
    sum /= max(total, 1e-6);
    float spread = sqrt(max(sum.y - sum.x * sum.x, 0.0)) / max(sum.x, 1e-4);
    float p = min(pixel_mm / widest_mm, LARGEST);
    float n = by.x + by_size * p + by.y * spread + by.z * sqrt(sum.w) * min(1.0, spread / full_spread) / (1.0 + p);
    int set = 0;
    for (int k = 1; k < SETS; ++k) if (n >= 0.5 * (counts[k - 1] + counts[k])) set = k;
    chosen = vec4(float(set), counts[set], floor(log(pixel_mm) / ladder.y + 0.5) - ladder.x, 0.0);
}
