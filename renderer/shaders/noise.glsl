// Solid noise with analytic gradients: vec4(value, gradient per unit of p).
vec4 value_noise(vec3 p) {  // quintic value noise in [-1, 1]
    vec3 cell = floor(p), f = p - cell;
    ivec3 c = ivec3(cell);
    vec3 u = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    vec3 du = 30.0 * f * f * (f * (f - 2.0) + 1.0);
    float a = unit(hash3(c)), b = unit(hash3(c + ivec3(1, 0, 0))), d = unit(hash3(c + ivec3(0, 1, 0))), e = unit(hash3(c + ivec3(1, 1, 0)));
    float g = unit(hash3(c + ivec3(0, 0, 1))), h = unit(hash3(c + ivec3(1, 0, 1))), i = unit(hash3(c + ivec3(0, 1, 1))), j = unit(hash3(c + ivec3(1, 1, 1)));
    float k1 = b - a, k2 = d - a, k3 = g - a, k4 = a - b - d + e, k5 = a - d - g + i, k6 = a - b - g + h, k7 = -a + b + d - e + g - h - i + j;
    float value = a + k1 * u.x + k2 * u.y + k3 * u.z + k4 * u.x * u.y + k5 * u.y * u.z + k6 * u.z * u.x + k7 * u.x * u.y * u.z;
    vec3 gradient = du * vec3(k1 + k4 * u.y + k6 * u.z + k7 * u.y * u.z, k2 + k5 * u.z + k4 * u.x + k7 * u.z * u.x, k3 + k6 * u.x + k5 * u.y + k7 * u.x * u.y);
    return vec4(2.0 * value - 1.0, 2.0 * gradient);
}
float noise(vec3 p) { return value_noise(p).x; }
float fbm(vec3 p) { return 0.5 * noise(p) + 0.27 * noise(p * 2.03 + 17.1) + 0.15 * noise(p * 4.01 + 5.3) + 0.08 * noise(p * 8.1 + 3.7); }

// Worley cells: distances and offsets to the two nearest feature points, and a hash of the nearest.
struct Cells { float f1; float f2; vec3 d1; vec3 d2; uint id; };
Cells cells(vec3 p) {
    ivec3 base = ivec3(floor(p));
    Cells r; r.f1 = 9.0; r.f2 = 9.0; r.d1 = vec3(0.0); r.d2 = vec3(0.0); r.id = 0u;
    for (int z = -1; z <= 1; ++z) for (int y = -1; y <= 1; ++y) for (int x = -1; x <= 1; ++x) {
        ivec3 c = base + ivec3(x, y, z);
        uint h = hash3(c);
        vec3 d = p - (vec3(c) + 0.1 + 0.8 * unit3(h));
        float q = dot(d, d);
        if (q < r.f1) { r.f2 = r.f1; r.d2 = r.d1; r.f1 = q; r.d1 = d; r.id = h; }
        else if (q < r.f2) { r.f2 = q; r.d2 = d; }
    }
    r.f1 = sqrt(r.f1); r.f2 = sqrt(r.f2);
    return r;
}
