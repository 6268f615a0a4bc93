// Lamps, panels, shadows and surface reflection shared by skin, eyes and hair.
uniform vec3 camera_position;
uniform vec3 lamp_direction[LAMPS];
uniform vec3 lamp_irradiance[LAMPS];
uniform float lamp_tangent[LAMPS];
uniform mat4 lamp_matrix[LAMPS];
uniform sampler2D lamp_depth_0;    // skin and eyes
uniform sampler2D lamp_depth_1;
uniform sampler2D lamp_strands_0;  // hair
uniform sampler2D lamp_strands_1;
uniform vec4 lobe_axis[LOBES];     // xyz, sharpness
uniform vec3 lobe_colour[LOBES];
uniform vec3 ambient;

float lamp_depth(int lamp, vec2 at) { return lamp == 0 ? texture(lamp_depth_0, at).r : texture(lamp_depth_1, at).r; }
float strand_depth(int lamp, vec2 at) { return lamp == 0 ? texture(lamp_strands_0, at).r : texture(lamp_strands_1, at).r; }
vec2 lamp_texel() { return 1.0 / vec2(textureSize(lamp_depth_0, 0)); }
// Lamp-space: uv and depth in mm.
vec3 to_lamp(int lamp, vec3 p) {
    vec3 q = (lamp_matrix[lamp] * vec4(p, 1.0)).xyz;
    return vec3(q.xy * 0.5 + 0.5, q.z);
}

float lamp_scale(int lamp) {  // uv per mm
    return 0.5 * length(vec3(lamp_matrix[lamp][0].x, lamp_matrix[lamp][1].x, lamp_matrix[lamp][2].x));
}

// Visibility of a lamp in [0, 1]: percentage-closer soft shadows (Fernando 2005) over a Vogel disc.
float visibility(int lamp, vec3 p, vec3 n, float phase) {
    float scale = lamp_scale(lamp);
    float slope = clamp(1.0 - dot(n, lamp_direction[lamp]), 0.0, 1.0);
    vec3 q = to_lamp(lamp, p + n * (0.35 + 0.9 * slope));
    float search = 28.0 * lamp_tangent[lamp] * scale;
    float sum = 0.0, count = 0.0;
    for (int k = 0; k < 12; ++k) {
        float z = lamp_depth(lamp, q.xy + search * vogel(k, 12, phase));
        if (z < q.z - 0.6) { sum += z; count += 1.0; }
    }
    float lit = 1.0;
    if (count > 0.0) {
        float penumbra = max((q.z - sum / count) * lamp_tangent[lamp], 0.25) * scale;
        lit = 0.0;
        for (int k = 0; k < 24; ++k) {
            vec2 o = penumbra * vogel(k, 24, phase + 1.7);
            lit += lamp_depth(lamp, q.xy + o) < q.z - 0.25 - 0.9 * length(o) / scale ? 0.0 : 1.0;
        }
        lit /= 24.0;
    }
    float through = 0.0;  // strands: a fixed small disc
    for (int k = 0; k < 12; ++k) {
        vec2 o = max(0.8 * scale, 1.5 * lamp_texel().x) * vogel(k, 12, phase + 0.4);
        through += strand_depth(lamp, q.xy + o) < q.z - 0.3 ? 0.0 : 1.0;
    }
    return lit * through / 12.0;
}

// Panels seen through a lobe of the given sharpness: the convolution of spherical Gaussians,
// Tsai and Shih 2006, doi:10.1145/1141911.1141981, in its product-integral form.
vec3 panels(vec3 direction, float sharpness) {
    vec3 total = ambient;
    for (int k = 0; k < LOBES; ++k) {
        float a = lobe_axis[k].w, wide = a * sharpness / (a + sharpness);
        total += lobe_colour[k] * (sharpness / (a + sharpness)) * exp(wide * (dot(lobe_axis[k].xyz, direction) - 1.0));
    }
    return total;
}

float schlick(float f0, float cosine) { return f0 + (1.0 - f0) * pow(clamp(1.0 - cosine, 0.0, 1.0), 5.0); }

// Kelemen and Szirmay-Kalos 2001 with a Beckmann distribution (1/pi: radiometric units); half vector not normalised.
float kelemen(vec3 n, vec3 v, vec3 l, float m, float f0) {
    vec3 h = l + v;
    vec3 u = normalize(h);
    float c = clamp(dot(n, u), 1e-3, 1.0), c2 = c * c;
    float d = exp((c2 - 1.0) / (m * m * c2)) / (PI * m * m * c2 * c2);
    return max(d * schlick(f0, max(dot(v, u), 0.0)) / max(dot(h, h), 1e-3), 0.0);
}
