// Local illumination models: the lobes of renderer/illumination/models.py, which cites their sources.
#define PHONG 1
#define BLINN_PHONG 2
#define COOK_TORRANCE 3

// (r . v)^exponent, or (n . h)^exponent.
float glossy_lobe(int model, vec3 n, vec3 l, vec3 v, float exponent) {
    if (model == PHONG) return pow(max(dot(reflect(-l, n), v), 0.0), exponent);
    return pow(max(dot(n, normalize(l + v)), 0.0), exponent);
}
float fresnel_exact(float c, float f0) {
    float s = min(sqrt(f0), 0.999), eta = (1.0 + s) / (1.0 - s);
    float g = sqrt(max(eta * eta + c * c - 1.0, 0.0));
    float a = (g - c) / (g + c), b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * a * a * (1.0 + b * b);
}
// F G D / (4 n . v).
float cook_torrance(vec3 n, vec3 l, vec3 v, float m, float f0) {
    vec3 h = normalize(l + v);
    float nh = clamp(dot(n, h), 1e-4, 1.0), nv = max(dot(n, v), 1e-3), nl = max(dot(n, l), 0.0), vh = max(dot(v, h), 1e-4);
    float c2 = nh * nh;
    float d = exp((c2 - 1.0) / (m * m * c2)) / (PI * m * m * c2 * c2);
    float g = min(1.0, 2.0 * nh * min(nv, nl) / vh);
    return fresnel_exact(vh, f0) * g * d / (4.0 * nv);
}
