// Light from all around: a constant, soft panels, a map; seen through a lobe of some sharpness.
uniform int panel_count;
uniform vec4 panel_axis[PANELS];      // xyz, sharpness
uniform vec3 panel_radiance[PANELS];
uniform vec3 ambient;
uniform sampler2DArray environment_map;  // latitude and longitude, one layer a sharpness of 4^layer
uniform float environment_layers;        // 0: there is no map
uniform mat3 environment_turn;           // world to map
uniform float environment_scale;

vec3 environment_at(vec3 direction, float sharpness) {
    vec3 d = environment_turn * direction;
    vec2 at = vec2(0.5 + atan(d.x, d.z) / (2.0 * PI), 0.5 + asin(clamp(d.y, -1.0, 1.0)) / PI);
    float level = clamp(0.5 * log2(max(sharpness, 1.0)), 0.0, environment_layers - 1.0);
    vec3 low = textureLod(environment_map, vec3(at, floor(level)), 0.0).rgb;
    vec3 high = textureLod(environment_map, vec3(at, min(floor(level) + 1.0, environment_layers - 1.0)), 0.0).rgb;
    return environment_scale * mix(low, high, fract(level));
}

// The environment seen through a lobe of the given sharpness: the convolution of spherical Gaussians,
// Tsai and Shih 2006, doi:10.1145/1141911.1141981, in its product-integral form; the map is convolved beforehand.
vec3 environment(vec3 direction, float sharpness) {
    vec3 total = ambient;
    for (int k = 0; k < panel_count; ++k) {
        float a = panel_axis[k].w, wide = a * sharpness / (a + sharpness);
        total += panel_radiance[k] * (sharpness / (a + sharpness)) * exp(wide * (dot(panel_axis[k].xyz, direction) - 1.0));
    }
    if (environment_layers > 0.0) total += environment_at(direction, sharpness);
    return total;
}

