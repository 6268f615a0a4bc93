// The margin of a lid (after passes/lids.glsl, shaders/noise.glsl): pink and wet from the ball to the lashes' roots. The upper one looks down, so
// from the front it is hardly seen and stands in shade; the lower one is seen from above. Its colour is the skin's, thinned, and mucosa.
uniform vec3 lid_margin; uniform vec3 lid_margin_shares; uniform float lash_line;
void to_margin(vec3 local, vec3 solid, inout vec3 albedo, inout float m) {
    vec2 lid = on_lid(local);
    if (lid.x > 5.0) return;
    float upper = lid.y, from = lid.x + 0.14 * noise(solid / 0.8) + 0.05 * noise(solid / 0.25);
    float margin = 1.0 - smoothstep(mix(0.10, 0.02, upper), mix(0.95, 0.34, upper), from);
    // pigment and the lashes' shade along their roots
    float roots = exp(-pow((from - mix(1.10, 0.40, upper)) / mix(0.45, 0.50, upper), 2.0));
    albedo *= 1.0 - min(lash_line * mix(0.7, 2.2, upper), 0.85) * vec3(0.88, 1.0, 1.0) * roots;
    // where it goes over into the lid's skin it is redder still
    albedo *= mix(vec3(1.0), vec3(0.97, 0.945, 0.94), (1.0 - smoothstep(0.6, 3.5, from)) * (1.0 - upper));
    vec3 mucosa = mix(albedo * vec3(0.90, 0.70, 0.67), lid_margin, lid_margin_shares.x) * (0.86 + 0.16 * noise(solid / 1.1));
    // dark where it touches the ball, and uneven along the ducts of its glands
    mucosa *= (1.0 - lid_margin_shares.y * exp(-max(lid.x, 0.0) / 0.28)) * (1.0 - 0.10 * smoothstep(0.1, 0.5, noise(solid / 0.45)));
    albedo = mix(albedo, mucosa * (1.0 - lid_margin_shares.z * upper), 0.9 * margin);
    m = mix(m, mix(0.20, 0.35, upper), margin);
}
