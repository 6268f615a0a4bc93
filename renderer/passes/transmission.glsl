// Light that comes through a thin part from behind, by its thickness in the lamps' depth maps: Jimenez et al. 2010, "Real-time
// realistic skin translucency", doi:10.1109/MCG.2010.39, over a table of renderer/optics/transmittance.py. Neither shadowed nor bumped.
uniform sampler2D transmittance;    // T over sqrt(thickness / reach)
uniform float transmittance_reach;  // mm; 0: nothing comes through
uniform float thickness_scale;      // mm of the medium per mm of thickness in the map
uniform float transmission_wrap;    // added to the cosine
uniform int transmission_thickness; // a place in renderer.optics.transmittance.THICKNESS

const float SHRINK = 0.6;  // mm that a point is moved inwards, so that it does not find itself in the map
const float GRAZING = 1.8; // mm more of it where light would leave along the surface: there the map's steps are deepest
const float BLUR = 0.7;    // mm over which the map is averaged
const float STEP = 0.4;    // mm over which the slope of the far face is taken
#define ALONG 1
#define ENTRY 2

// The outward normal of what a lamp sees at a place of its map. layer_matrix: its first rows lie along the map.
vec3 entry_normal(int lamp, int layer, vec2 at, float scale, vec3 l) {
    vec2 x = vec2(STEP * scale, 0.0), y = x.yx;
    vec2 slope = vec2(layer_depth(layer, at + x) - layer_depth(layer, at - x), layer_depth(layer, at + y) - layer_depth(layer, at - y)) / (2.0 * STEP);
    mat3 m = mat3(layer_matrix[layer]);
    vec3 right = normalize(vec3(m[0].x, m[1].x, m[2].x)), up = normalize(vec3(m[0].y, m[1].y, m[2].y));
    return normalize(slope.x * right + slope.y * up + l);
}

vec3 transmitted(int lamp, vec3 p, vec3 n) {
    vec3 l = lamp_towards(lamp, p);
    float cosine = dot(l, -n), facing = clamp(transmission_wrap + cosine, 0.0, 1.0);
    if (lamp_layer[lamp] < 0 || transmittance_reach <= 0.0 || facing <= 0.0) return vec3(0.0);
    float shrink = SHRINK + GRAZING * pow(1.0 - clamp(cosine, 0.0, 1.0), 2.0);
    vec3 inner = p - n * shrink;
    int layer = layer_of(lamp, inner);
    vec3 q = to_layer(layer, inner);
    float scale = scale_of(lamp, layer, q.z), entries = float(textureSize(transmittance, 0).x);
    vec3 total = vec3(0.0);
    for (int k = 0; k < 8; ++k) {
        vec2 at = q.xy + scale * BLUR * vogel(k, 8, 0.0);
        float along = max(q.z - layer_depth(layer, at), 0.0), falls = facing, thickness;
        if (transmission_thickness == ALONG) {
            thickness = max(along + (shrink - SHRINK) / max(cosine, 0.1) + SHRINK * max(cosine, 0.0), 0.0);
        } else {
            vec3 far = entry_normal(lamp, layer, at, scale, l);
            if (transmission_thickness == ENTRY) {
                falls = clamp(transmission_wrap + dot(far, l), 0.0, 1.0);
                thickness = along * max(dot(far, l), 0.0) + shrink;
            } else {  // GPU Gems 3, ch. 14.5.3: of a part whose far side faces away from here the thickness counts, not the slanted way
                thickness = along * mix(1.0, max(cosine, 0.0), clamp(-dot(far, n), 0.0, 1.0)) + shrink;
            }
        }
        float place = min(sqrt(thickness_scale * thickness / transmittance_reach), 1.0);
        total += falls * texture(transmittance, vec2((place * (entries - 1.0) + 0.5) / entries, 0.5)).rgb;
    }
    return total / 8.0 * lamp_light(lamp, p);
}
