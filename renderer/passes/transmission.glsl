// Light that comes through a thin part from behind, by its thickness in the lamps' depth maps: Jimenez et al. 2010, "Real-time
// realistic skin translucency", doi:10.1109/MCG.2010.39, over a table of renderer/optics/transmittance.py. Neither shadowed nor bumped.
uniform sampler2D transmittance;    // T over sqrt(thickness / reach)
uniform float transmittance_reach;  // mm; 0: nothing comes through
uniform float thickness_scale;      // mm of the medium per mm of thickness in the map
uniform float transmission_wrap;    // added to the cosine

const float SHRINK = 0.6;  // mm that a point is moved inwards, so that it does not find itself in the map
const float BLUR = 0.7;    // mm over which the map is averaged

vec3 transmitted(int lamp, vec3 p, vec3 n) {
    float cosine = dot(lamp_towards(lamp, p), -n), facing = clamp(transmission_wrap + cosine, 0.0, 1.0);
    if (lamp_layer[lamp] < 0 || transmittance_reach <= 0.0 || facing <= 0.0) return vec3(0.0);
    vec3 inner = p - n * SHRINK;
    int layer = layer_of(lamp, inner);
    vec3 q = to_layer(layer, inner);
    float scale = scale_of(lamp, layer, q.z), entries = float(textureSize(transmittance, 0).x);
    vec3 total = vec3(0.0);
    for (int k = 0; k < 8; ++k) {
        float z = layer_depth(layer, q.xy + scale * BLUR * vogel(k, 8, 0.0));
        float thickness = thickness_scale * max(q.z + SHRINK * max(cosine, 0.0) - z, 0.0);
        float place = min(sqrt(thickness / transmittance_reach), 1.0);
        total += texture(transmittance, vec2((place * (entries - 1.0) + 0.5) / entries, 0.5)).rgb;
    }
    return total / 8.0 * facing * lamp_light(lamp, p);
}
