// Lamps of every kind, shadows, environment and surface reflection, shared by skin, eyes and hair.
uniform vec3 camera_position;
uniform int lamps;
uniform vec4 lamp_place[LAMPS];       // xyz: towards a distant lamp (w = 0), or position in mm (w = 1)
uniform vec3 lamp_irradiance[LAMPS];
uniform vec4 lamp_falloff[LAMPS];     // c1, c2 per mm, c3 per mm^2; the limit of 1 / (c1 + c2 d + c3 d^2)
uniform vec4 lamp_cone[LAMPS];        // xyz: axis away from the lamp, w: cosine of the outer angle (-2: no cone)
uniform float lamp_ramp[LAMPS];       // cosine of the inner angle less that of the outer
uniform float lamp_size[LAMPS];       // tangent of the angular radius, or the radius in mm
uniform float lamp_search[LAMPS];     // mm in front of a point that are searched for what shades it
uniform int lamp_layer[LAMPS];        // first layer of its shadow map; -1: none
uniform int lamp_faces[LAMPS];        // layers: 1, or the 6 faces of a cube about the lamp
uniform mat4 layer_matrix[LAYERS];    // world to the map: xy (over w), z in mm along the layer's axis
uniform float layer_scale[LAYERS];    // uv per mm, for a cone at a depth of 1 mm
uniform int strand_layer[LAMPS];      // the same of the maps of hair, which are no wider than it is
uniform int strand_faces[LAMPS];
uniform mat4 strand_matrix[STRAND_LAYERS];
uniform float strand_scale[STRAND_LAYERS];
uniform float depth_range;            // mm of depth 1 in the maps
uniform sampler2DArray solid_depth;   // surfaces and eyes
uniform sampler2DArray strand_depth;  // the first strand of hair
uniform sampler2DArray strand_sums;   // optical depth of strands up to DEEP_MM behind it
#include "shaders/deep.glsl"
#include "shaders/environment.glsl"

bool distant(int lamp) { return lamp_place[lamp].w == 0.0; }
vec3 lamp_towards(int lamp, vec3 p) {
    return distant(lamp) ? lamp_place[lamp].xyz : normalize(lamp_place[lamp].xyz - p);
}
// Irradiance on a surface at p that faces the lamp, unshadowed.
vec3 lamp_light(int lamp, vec3 p) {
    if (distant(lamp)) return lamp_irradiance[lamp];
    vec3 away = p - lamp_place[lamp].xyz;
    float d = length(away);
    vec4 c = lamp_falloff[lamp];
    float falloff = min(1.0 / max(c.x + c.y * d + c.z * d * d, 1e-12), c.w);
    float t = clamp((dot(away / d, lamp_cone[lamp].xyz) - lamp_cone[lamp].w) / max(lamp_ramp[lamp], 1e-6), 0.0, 1.0);
    return lamp_irradiance[lamp] * falloff * (lamp_cone[lamp].w < -1.5 ? 1.0 : t * t);
}

// Sine of the angle that half of a lamp takes up, seen from p: a disc that faces p.
float lamp_sine(int lamp, vec3 p) {
    float size = lamp_size[lamp], d = distant(lamp) ? 1.0 : length(lamp_place[lamp].xyz - p);
    return min(size * inversesqrt(size * size + d * d), 0.999);
}
// Irradiance on a surface with normal n over that on one that faces the lamp: the cosine, and where the horizon cuts the disc, the
// exact integral over what is left of it (Lagarde and de Rousiers 2014, "Moving Frostbite to PBR", listing 10).
float lamp_facing(int lamp, vec3 p, vec3 n) {
    float c = clamp(dot(n, lamp_towards(lamp, p)), -1.0, 1.0), s = lamp_sine(lamp, p);
    if (c * c >= s * s || s < 1e-3) return max(c, 0.0);
    float x = sqrt(1.0 / (s * s) - 1.0), sine = sqrt(1.0 - c * c), y = clamp(-x * c / sine, -1.0, 1.0), root = sine * sqrt(1.0 - y * y);
    return max(((c * acos(y) - x * root) + atan(root / x) / (s * s)) / PI, 0.0);
}
// Radiance of a lamp in a mirror direction r, edges blurred over `blur` radians: what a smooth wet surface shows.
vec3 lamp_mirrored(int lamp, vec3 p, vec3 r, float blur) {
    float s = lamp_sine(lamp, p), radius = asin(s);
    float away = acos(clamp(dot(r, lamp_towards(lamp, p)), -1.0, 1.0));
    return lamp_light(lamp, p) * (1.0 - smoothstep(radius - blur, radius + blur, away)) / (PI * (s * s + 0.18 * blur * blur));
}

float layer_depth(int layer, vec2 at) { return texture(solid_depth, vec3(at, float(layer))).r * depth_range; }
// The place of the layer that sees p: the only one, or the cube's face (+x, -x, +y, -y, +z, -z).
int face_of(int lamp, int faces, vec3 p) {
    if (faces == 1) return 0;
    vec3 d = p - lamp_place[lamp].xyz, a = abs(d);
    return a.x >= a.y && a.x >= a.z ? (d.x < 0.0 ? 1 : 0) : a.y >= a.z ? (d.y < 0.0 ? 3 : 2) : (d.z < 0.0 ? 5 : 4);
}
int layer_of(int lamp, vec3 p) { return lamp_layer[lamp] + face_of(lamp, lamp_faces[lamp], p); }
// Map coordinates and depth in mm.
vec3 to_map(mat4 matrix, vec3 p) {
    vec4 q = matrix * vec4(p, 1.0);
    return vec3(q.xy / q.w * 0.5 + 0.5, q.z);
}
vec3 to_layer(int layer, vec3 p) { return to_map(layer_matrix[layer], p); }
float scale_of(int lamp, int layer, float depth) {  // uv per mm
    return distant(lamp) ? layer_scale[layer] : layer_scale[layer] / max(depth, 1.0);
}

// Share of a lamp's light that surfaces let past: percentage-closer soft shadows (Fernando 2005) over a Vogel disc.
float surfaces_let_past(int lamp, vec3 p, vec3 n, float phase) {
    if (lamp_layer[lamp] < 0) return 1.0;
    float slope = clamp(1.0 - dot(n, lamp_towards(lamp, p)), 0.0, 1.0);
    vec3 inner = p + n * (0.35 + 0.9 * slope);
    int layer = layer_of(lamp, inner);
    vec3 q = to_layer(layer, inner);
    float scale = scale_of(lamp, layer, q.z), size = lamp_size[lamp];
    // The surface's own plane in the map, mm of depth a mm across (Isidoro 2006, "Shadow mapping: GPU-based tips and techniques"):
    // what lies on it does not shade it.
    mat4 map = layer_matrix[layer];
    vec3 right = normalize(vec3(map[0][0], map[1][0], map[2][0])), over = normalize(vec3(map[0][1], map[1][1], map[2][1]));
    float facing = max(-dot(n, vec3(map[0][2], map[1][2], map[2][2])), 0.2);
    vec2 rise = vec2(dot(n, right), dot(n, over)) / facing;
    float reach = distant(lamp) ? size : size / max(q.z - lamp_search[lamp], 0.1 * q.z);
    float search = lamp_search[lamp] * reach * scale;
    float sum = 0.0, count = 0.0;
    for (int k = 0; k < 12; ++k) {
        vec2 o = search * vogel(k, 12, phase);
        float z = layer_depth(layer, q.xy + o);
        if (z < q.z + dot(rise, o) / scale - 0.6 - 0.1 * length(o) / scale) { sum += z; count += 1.0; }
    }
    if (count == 0.0) return 1.0;
    float blocker = sum / count;
    float width = distant(lamp) ? (q.z - blocker) * size : size * (q.z - blocker) / max(blocker, 1.0);
    float texel = 1.0 / float(textureSize(solid_depth, 0).x);
    float penumbra = max(max(width, 0.25) * scale, 2.0 * texel), lit = 0.0;  // wider than the map's own steps
    for (int k = 0; k < 24; ++k) {
        vec2 o = penumbra * vogel(k, 24, phase + 1.7);
        lit += layer_depth(layer, q.xy + o) < q.z + dot(rise, o) / scale - 0.25 - 0.1 * length(o) / scale ? 0.0 : 1.0;
    }
    return lit / 24.0;
}

// Optical depth of strands before a depth in a lamp's map: deep opacity maps, Yuksel and Keyser 2008.
float strands_at(int layer, vec2 at, float depth) {
    float d = depth - texture(strand_depth, vec3(at, float(layer))).r * depth_range;
    if (d <= 0.0) return 0.0;
    vec4 s = texture(strand_sums, vec3(at, float(layer))), m = DEEP_MM;
    if (d < m.x) return s.x * d / m.x;
    if (d < m.y) return mix(s.x, s.y, (d - m.x) / (m.y - m.x));
    if (d < m.z) return mix(s.y, s.z, (d - m.y) / (m.z - m.y));
    return mix(s.z, s.w, min((d - m.z) / (m.w - m.z), 1.0));
}
// Optical depth of the strands between p and a lamp: of their mean transmittance over a disc of `least` mm, or as wide as the lamp is
// behind the first strand. Strands count up to `nearer` mm before p.
float strands_before(int lamp, vec3 p, float nearer, float least, float phase) {
    if (strand_layer[lamp] < 0) return 0.0;
    int layer = strand_layer[lamp] + face_of(lamp, strand_faces[lamp], p);
    vec3 q = to_map(strand_matrix[layer], p);
    float scale = distant(lamp) ? strand_scale[layer] : strand_scale[layer] / max(q.z, 1.0);
    float first = depth_range, texel = 1.0 / float(textureSize(strand_depth, 0).x);
    float size = distant(lamp) ? lamp_size[lamp] : lamp_size[lamp] / max(q.z, 1.0);
    for (int k = 0; k < 5; ++k) {  // the nearest of what stands before it
        vec2 o = max(2.0 * texel, 12.0 * size * scale) * vogel(k, 5, phase);
        first = min(first, texture(strand_depth, vec3(q.xy + o, float(layer))).r * depth_range);
    }
    float wide = max(max(least, clamp(q.z - first, 0.0, 60.0) * size) * scale, 1.3 * texel), sum = 0.0;
    for (int k = 0; k < 10; ++k) sum += exp(-strands_at(layer, q.xy + wide * vogel(k, 10, phase + 0.4), q.z + nearer));
    return -log(max(sum / 10.0, 1e-4));
}

float strand_disc_mm = 0.2;  // how wide a disc of strands is averaged at least; the ball under lashes says more
// Visibility of a lamp in [0, 1] from a surface: past surfaces and through hair.
float visibility(int lamp, vec3 p, vec3 n, float phase) {
    if (lamp_layer[lamp] < 0) return 1.0;
    float lit = surfaces_let_past(lamp, p, n, phase);
    return lit > 0.0 ? lit * exp(-strands_before(lamp, p, -0.02, strand_disc_mm, phase)) : 0.0;
}

// What a lamp's size adds to the squared Beckmann slope of a mirror that shows it: a disc of the sine t is t/2 of slopes of the half
// vector, whose variance is t^2/16 along each axis.
float lamp_spread(int lamp, vec3 p) {
    float t = lamp_sine(lamp, p);
    return 0.125 * t * t;
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
