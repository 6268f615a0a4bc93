// Hashes, noise and small helpers shared by several passes. Integer hashes: the same bits on every driver.
const float PI = 3.14159265358979;

uint mix_bits(uint x) {  // "lowbias32", Chris Wellons, public domain
    x ^= x >> 16; x *= 0x7feb352du;
    x ^= x >> 15; x *= 0x846ca68bu;
    return x ^ (x >> 16);
}
uint hash3(ivec3 c) { return mix_bits(uint(c.x) + mix_bits(uint(c.y) + mix_bits(uint(c.z)))); }
float unit(uint h) { return float(h >> 8) * (1.0 / 16777216.0); }
vec3 unit3(uint h) { return vec3(unit(h), unit(mix_bits(h ^ 0x68e31da4u)), unit(mix_bits(h ^ 0xb5297a4du))); }

// Interleaved gradient noise, Jimenez 2014, "Next generation post processing in Call of Duty: Advanced Warfare".
float interleaved_gradient_noise(vec2 pixel) {
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}
// Vogel's spiral on the unit disc, turned by `phase`: where k is a constant, so is its place, and all places share one sine.
vec2 vogel(int k, int n, float phase) {
    float a = 2.39996323 * float(k);
    vec2 place = sqrt((float(k) + 0.5) / float(n)) * vec2(cos(a), sin(a)), turn = vec2(cos(phase), sin(phase));
    return vec2(place.x * turn.x - place.y * turn.y, place.x * turn.y + place.y * turn.x);
}
vec3 from_srgb(vec3 c) { return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), step(0.04045, c)); }
vec3 to_srgb(vec3 c) { return mix(c * 12.92, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c)); }
