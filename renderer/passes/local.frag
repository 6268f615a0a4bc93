// A surface by a local illumination model (renderer/scene/material.py, Shading): lamps, ambient light, emission.
#include "shaders/common.glsl"
#include "shaders/lighting.glsl"
#include "shaders/models.glsl"
#include "passes/surface_out.glsl"
uniform int model_number;             // place in MODELS of renderer/scene/material.py
uniform int has_albedo_map; uniform sampler2D albedo_map; uniform vec3 albedo_colour;
uniform vec3 k_a;                     // negative: the albedo
uniform vec3 k_s; uniform float exponent; uniform float roughness; uniform float f0;
uniform vec3 emission;
uniform vec3 mean_radiance;           // of the environment, over all directions: I_a

void main() {
#if DOMAIN == POINTS
    if (!take_place()) discard;
#endif
    vec3 n = normalize(world_normal), v = normalize(camera_position - world);
#if DOMAIN == SCREEN
    if (!gl_FrontFacing) n = -n;
#endif
    vec3 albedo = has_albedo_map == 1 ? from_srgb(map_at(albedo_map, uv).rgb) : albedo_colour;
    float phase = 2.0 * PI * interleaved_gradient_noise(gl_FragCoord.xy);
    vec3 irradiance = vec3(0.0), specular = vec3(0.0);
    for (int k = 0; k < lamps; ++k) {
        vec3 l = lamp_towards(k, world);
        float nl = dot(n, l);
        if (nl <= 0.0) continue;
        vec3 e = lamp_light(k, world) * visibility(k, world, n, phase);
        irradiance += e * nl;
        if (model_number == COOK_TORRANCE) specular += e * k_s * cook_torrance(n, l, v, roughness, f0);
        else if (model_number > 0) specular += e * k_s * glossy_lobe(model_number, n, l, v, exponent) / PI;
    }
    vec3 even = (k_a.x < 0.0 ? albedo : k_a) * mean_radiance;
    out_irradiance = vec4(irradiance, 0.0);
    out_specular = vec4(specular + even + emission, 1.0);
    out_albedo = vec4(albedo, 1.0);
    put_place(n);
#if DOMAIN != SCREEN
    out_transmitted = vec4(0.0);
#endif
}
