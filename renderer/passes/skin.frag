// Skin: colour and relief (procedural, from maps, or the one over the other), lamps, baked environment.
#include "shaders/common.glsl"
#include "shaders/noise.glsl"
#include "shaders/lighting.glsl"
#include "shaders/diffuse.glsl"
#include "passes/surface_out.glsl"
#if DOMAIN != SCREEN
#include "passes/transmission.glsl"
#endif
uniform vec3 eye_l; uniform vec3 eye_r; uniform vec3 mouth; uniform vec3 nose;
uniform int procedural;
uniform int has_albedo_map; uniform int has_normal_map; uniform int has_roughness_map; uniform int has_height_map; uniform int has_specular_map;
uniform sampler2D albedo_map; uniform sampler2D normal_map; uniform sampler2D roughness_map; uniform sampler2D height_map; uniform sampler2D specular_map;
uniform float height_mm;  // of the height map, from black to white
// 1: drawn, 0: left out over an albedo map
uniform float layer_relief; uniform float layer_freckles; uniform float layer_moles; uniform float layer_mottling; uniform float layer_hair; uniform float layer_oil;
uniform vec3 albedo_colour;
uniform float roughness; uniform float f0; uniform float specular_strength;
uniform vec2 lobe_roughness; uniform float lobe_share;
uniform float melanin; uniform float blood; uniform float flush; uniform float mottling;
uniform vec3 melanin_absorbance; uniform vec3 blood_absorbance; uniform vec3 dermis; uniform vec3 lip;
uniform float freckles; uniform float freckle_share; uniform float moles; uniform float mole_share;
uniform float beard_tint; uniform float scalp_tint;
uniform float pore_depth; uniform float furrow_depth; uniform float bump_height; uniform float wrinkle_depth; uniform float lip_folds;
uniform float roughness_dry; uniform float roughness_oily;
// Where wrinkles lie, mm (renderer/scene/material.py): vec4 and vec2 say where they set in, are whole, begin to end, have ended.
uniform vec4 forehead_lines; uniform vec2 forehead_lines_half; uniform float forehead_lines_period;
uniform vec2 crows_feet_place; uniform vec4 crows_feet; uniform vec2 crows_feet_angle;
uniform vec4 lid_lines; uniform vec2 lid_lines_half; uniform float lid_lines_period;
uniform vec2 wrinkles_behind;  // the eyes: on the forehead, around the eyes
uniform float material_id;           // 1, 2, ...: which medium scatters below; 0: none
uniform float even_light;           // 1, or 0: what the environment and other surfaces send is left out
uniform vec3 noise_origin;           // mm: the seed's place in the solid noise

float fade(float size_mm, float pixel_mm) { float r = pixel_mm / size_mm; return 1.0 / (1.0 + 6.0 * r * r); }

// Height in mm (x) and its gradient (yzw) of pores, furrows, bumps and wrinkles at p.
vec4 relief(vec3 p, float pixel_mm, out float pore_shade) {
    float lips = a.x, eyelid = a.w, pores = b.x, inside = b.w;
    vec3 q = p + noise_origin;
    vec4 h = vec4(0.0);
    pore_shade = 0.0;
    float skin = (1.0 - lips) * (1.0 - inside);

    // pores: two sizes of pits
    for (int k = 0; k < 2; ++k) {
        float size = k == 0 ? 0.95 : 0.60;
        Cells c = cells(q / size);
        float own = 0.35 + 0.65 * unit(mix_bits(c.id ^ 0x51u));
        float depth = pore_depth * (k == 0 ? 0.042 : 0.022) * pores * own * skin * fade(size * 0.6, pixel_mm);
        float w = k == 0 ? 0.30 : 0.28;
        float e = exp(-c.f1 * c.f1 / (w * w));
        h.x -= depth * e;
        h.yzw += depth * e * 2.0 / (w * w) * c.d1 / size;
        pore_shade += (k == 0 ? 1.0 : 0.5) * e * own * pores * skin * fade(size * 0.6, pixel_mm);
        // furrows between the cells of the larger net
        if (k == 0) {
            Cells g = cells(q / 0.72 + 31.7);
            float gap = g.f2 - g.f1, wide = 0.16;
            float f = exp(-gap * gap / (wide * wide));
            float deep = furrow_depth * 0.015 * skin * (1.0 - 0.7 * pores) * fade(0.5, pixel_mm);
            vec3 d = g.d2 / max(g.f2, 1e-3) - g.d1 / max(g.f1, 1e-3);
            h.x -= deep * f;
            h.yzw += deep * f * 2.0 * gap / (wide * wide) * d / 0.72;
        }
    }
    // bumps of 1.6, 4 and 11 mm
    vec4 n1 = value_noise(q / 1.6), n2 = value_noise(q / 4.1 + 7.0), n3 = value_noise(q / 11.0 + 3.0);
    float t1 = 0.022 * skin * fade(1.0, pixel_mm), t2 = 0.045 * skin, t3 = 0.16 * (1.0 - inside) * (1.0 - 0.6 * lips);
    h += bump_height * (t1 * vec4(n1.x, n1.yzw / 1.6) + t2 * vec4(n2.x, n2.yzw / 4.1) + t3 * vec4(n3.x, n3.yzw / 11.0));

    // forehead: three faint lines that wander
    vec3 eyes = 0.5 * (eye_l + eye_r);
    vec3 f = p - eyes;
    float brow = smoothstep(forehead_lines.x, forehead_lines.y, f.y) * (1.0 - smoothstep(forehead_lines.z, forehead_lines.w, f.y))
        * (1.0 - smoothstep(forehead_lines_half.x, forehead_lines_half.y, abs(f.x))) * step(0.0, p.z - eyes.z + wrinkles_behind.x);
    if (brow > 0.0) {
        vec4 warp = value_noise(vec3(q.x / 22.0, q.y / 34.0, 2.0));
        float y = f.y + 3.0 * warp.x;
        float period = forehead_lines_period, phase = fract(y / period) - 0.5, s = phase * period;
        float strength = 0.5 + 0.5 * noise(vec3(q.x / 16.0, floor(y / period) * 3.1, 5.0));
        float w = 0.9, g = exp(-s * s / (w * w)) * wrinkle_depth * 0.045 * strength * brow;
        h.x -= g;
        h.z += g * 2.0 * s / (w * w);
    }
    // crow's feet and the fine lines below the eyes
    for (int k = 0; k < 2; ++k) {
        vec3 eye = k == 0 ? eye_l : eye_r;
        float side = k == 0 ? 1.0 : -1.0;
        vec2 d = vec2(side * (p.x - eye.x) - crows_feet_place.x, p.y - eye.y - crows_feet_place.y);
        float r = length(d), angle = atan(d.y, d.x);
        float feet = smoothstep(crows_feet.x, crows_feet.y, r) * (1.0 - smoothstep(crows_feet.z, crows_feet.w, r))
            * (1.0 - smoothstep(crows_feet_angle.x, crows_feet_angle.y, abs(angle)));
        if (feet > 0.0 && p.z > eye.z - wrinkles_behind.y) {
            float s = angle * 5.5 + 0.9 * noise(q / 5.0);
            float g = pow(0.5 + 0.5 * cos(s * 2.0 * PI / 1.6), 6.0) * wrinkle_depth * 0.035 * feet;
            h.x -= g;
            float slope = wrinkle_depth * 0.035 * feet * 6.0 * pow(0.5 + 0.5 * cos(s * 2.0 * PI / 1.6), 5.0) * 0.5 * sin(s * 2.0 * PI / 1.6) * 2.0 * PI / 1.6 * 5.5 / max(r, 2.0);
            h.yz += slope * vec2(-sin(angle) * side, cos(angle));
        }
        vec2 e = vec2(p.x - eye.x, p.y - eye.y);
        float bag = smoothstep(lid_lines.x, lid_lines.y, e.y) * (1.0 - smoothstep(lid_lines.z, lid_lines.w, e.y))
            * (1.0 - smoothstep(lid_lines_half.x, lid_lines_half.y, abs(e.x)));
        if (bag > 0.0 && p.z > eye.z - wrinkles_behind.y) {
            float s = e.y + 0.012 * e.x * e.x + 1.2 * noise(q / vec3(9.0, 4.0, 9.0));
            float wave = 2.0 * PI / lid_lines_period;
            h.x += wrinkle_depth * 0.02 * bag * cos(s * wave);
            h.z -= wrinkle_depth * 0.02 * bag * sin(s * wave) * wave * 0.5;
        }
    }
    // lips: vertical folds that fan out
    if (lips > 0.01) {
        vec2 d = vec2(p.x - mouth.x, (p.y - mouth.y) * 0.35);
        float s = d.x * (1.0 + 0.10 * noise(q / 6.0)) + 0.9 * noise(q / vec3(2.4, 7.0, 2.4));
        float wave = 2.0 * PI / 1.25;
        float g = 0.5 + 0.5 * cos(s * wave), amp = lip_folds * 0.040 * lips * fade(1.0, pixel_mm) * (0.6 + 0.4 * noise(q / 3.0 + 9.0));
        h.x -= amp * pow(g, 3.0);
        h.y += amp * 3.0 * g * g * 0.5 * sin(s * wave) * wave;
        Cells c = cells(q / 0.8 + 11.0);
        h.yzw += lip_folds * 0.006 * fade(0.6, pixel_mm) * lips * c.d1;
    }
    return h;
}

// Skin colour: melanin and haemoglobin as absorbances over a pale dermis, or more of them over what a map shows, one Beer-Lambert law
// per pigment.
vec3 colour(vec3 p, float pixel_mm, float pore_shade, bool mapped, vec3 map) {
    float lips = a.x, flushed = a.y, hair = a.z, eyelid = a.w, beard = beard_tint * b.z, inside = b.w;
    vec3 q = p + noise_origin;
    float broad = fbm(q / 38.0), patchy = fbm(q / 9.0 + 4.0), fine = noise(q / 2.2 + 2.0) * fade(1.5, pixel_mm);
    float m = melanin + 0.045 * broad + 0.040 * patchy + 0.018 * fine + 0.05 * eyelid + 0.060 * pore_shade;
    float h = blood + flush * flushed + 0.075 * fbm(q / 15.0 + 21.0) + 0.045 * patchy * noise(q / 5.0 + 1.0) + 0.05 * eyelid;
    if (mapped) { m = 0.060 * pore_shade; h = 0.0; }
    // capillary mottling, strongest where the skin is flushed
    h += layer_mottling * mottling * (0.05 + 0.13 * flushed) * max(fbm(q / 3.2 + 40.0), 0.0) * fade(2.0, pixel_mm);
    // freckles and a few moles
    Cells c = cells(q / 7.5);
    float freckle = step(1.0 - freckle_share, unit(mix_bits(c.id ^ 3u))) * smoothstep(0.13, 0.05, c.f1 + 0.03 * noise(q * 2.0));
    m += layer_freckles * freckles * freckle * (1.0 - lips);
    Cells spots = cells(q / 31.0 + 3.0);
    float mole = step(1.0 - mole_share, unit(mix_bits(spots.id ^ 7u))) * smoothstep(0.040, 0.024, spots.f1 + 0.006 * noise(q * 1.7));
    m += layer_moles * moles * mole * (1.0 - lips);
    // hair below the surface: scalp and shaven beard, dots that merge with distance
    Cells d = cells(q / 0.85 + 8.0);
    float dots = mix(0.22, smoothstep(0.34, 0.16, d.f1), fade(0.9, pixel_mm));
    hair *= layer_hair;
    beard *= layer_hair;
    float rooted = clamp(hair + 0.75 * beard, 0.0, 1.0) * (0.75 + 0.25 * noise(q / 4.0));
    vec3 skin = (mapped ? map : dermis) * exp(-m * melanin_absorbance - h * blood_absorbance);
    vec3 lip_colour = lip * (1.0 + 0.10 * fbm(q / 2.5) + 0.06 * noise(q / 0.9));
    if (!mapped) skin = mix(skin, lip_colour, 0.88 * smoothstep(0.12, 0.85, lips + 0.10 * noise(q / 1.3)));
    skin *= mix(vec3(1.0), vec3(0.42, 0.40, 0.40), hair * scalp_tint) * (1.0 - rooted * vec3(0.20, 0.18, 0.15) - 0.45 * dots * rooted);
    if (!mapped) skin = mix(skin, vec3(0.30, 0.07, 0.06), inside);
    return skin;
}

// A normal turned by the height map: Mikkelsen 2010, "Bump mapping unparametrized surfaces on the GPU", doi:10.1080/2151237X.2010.10390651.
vec3 bumped(vec3 n) {
    vec3 dx = step_x, dy = step_y;
    vec2 du = uv_x, dv = uv_y;
    float here = map_at(height_map, uv).r;
    vec2 rise = height_mm * length(model[0].xyz) * vec2(map_at(height_map, uv + du).r - here, map_at(height_map, uv + dv).r - here);
    vec3 across = cross(dy, n), along = cross(n, dx);
    float area = dot(dx, across);
    if (area == 0.0) return n;
    return normalize(abs(area) * n - sign(area) * (rise.x * across + rise.y * along));
}

float strength;  // of specular light, after its map

// The share of the light that the two lobes send back, of light from a direction or from everywhere.
float sent_back(vec3 one, vec3 two) {
    float back = mix(dot(vec2(f0, 1.0), one.xy), dot(vec2(f0, 1.0), two.xy), lobe_share);
    return clamp(strength * back, 0.0, 1.0);
}
float sent_back(float cosine, float m) {
    return sent_back(face(cosine, m * lobe_roughness.x), face(cosine, min(m * lobe_roughness.y, 0.9)));
}
float sent_back_even(float m) {
    return sent_back(face_even(m * lobe_roughness.x), face_even(min(m * lobe_roughness.y, 0.9)));
}
// What of a lamp's light goes in, and what of even light. Over an atlas or points nobody looks on.
float goes_in(vec3 n, vec3 v, vec3 l, float m) {
#if DIFFUSE == DISNEY
    float lh = dot(l, normalize(l + v)), f90 = 0.5 + 2.0 * m * lh * lh;
    return (1.0 + (f90 - 1.0) * pow(1.0 - dot(n, l), 5.0)) * (1.0 + (f90 - 1.0) * pow(1.0 - max(dot(n, v), 0.0), 5.0));
#elif DIFFUSE == CONSERVING
    return 1.0 - sent_back(dot(n, l), m);
#else
    return 1.0;
#endif
}
float goes_in_even(float nv, float m) {
#if DIFFUSE == DISNEY
    return face(nv, m).z;
#elif DIFFUSE == CONSERVING
    return 1.0 - sent_back_even(m);
#else
    return 1.0;
#endif
}

void main() {
#if DOMAIN == POINTS
    if (!take_place()) discard;
#endif
    vec3 smooth_n = normalize(world_normal);
    vec3 v = normalize(camera_position - world);
#if DOMAIN == SCREEN
    if (dot(smooth_n, v) < 0.0 && !gl_FrontFacing) smooth_n = -smooth_n;
#endif
    float pixel_mm = footprint_mm();
    vec3 n = smooth_n;
    vec3 albedo = albedo_colour;
    float m = roughness;
    float shade = 0.0;
    if (has_albedo_map == 1) albedo = from_srgb(map_at(albedo_map, uv).rgb);
    if (has_normal_map == 1) {
        vec3 dp1 = step_x, dp2 = step_y;
        vec2 du1 = uv_x, du2 = uv_y;
        vec3 t = dp1 * du2.y - dp2 * du1.y, s = dp2 * du1.x - dp1 * du2.x;
        float longest = max(dot(t, t), dot(s, s));
        if (longest > 0.0) {
            float facing = sign(du1.x * du2.y - du1.y * du2.x);
            vec3 map = map_at(normal_map, uv).xyz * 2.0 - 1.0;
            n = normalize(mat3(t * facing * inversesqrt(longest), s * facing * inversesqrt(longest), smooth_n) * map);
        }
    }
    if (has_height_map == 1) n = bumped(n);
    if (procedural == 1) {
        if (layer_relief > 0.0) {
            vec4 h = relief(local, pixel_mm, shade);
            vec3 slope = mat3(model) * h.yzw / length(model[0].xyz);  // relief grows with its object
            n = normalize(n - (slope - n * dot(slope, n)));
        }
        albedo = colour(local, pixel_mm, shade, has_albedo_map == 1, albedo);
        if (layer_oil > 0.0) m = mix(roughness_dry, roughness_oily, b.y) - 0.08 * a.x + 0.03 * noise((local + noise_origin) / 3.0);
    }
    if (has_roughness_map == 1) m = clamp(map_at(roughness_map, uv).r, 0.12, 0.9);
    strength = specular_strength;
    if (has_specular_map == 1) strength *= map_at(specular_map, uv).r;
#if DOMAIN == SCREEN
    if (dot(n, v) < 0.02) n = normalize(n + v * (0.02 - dot(n, v)));
#endif

    float phase = 2.0 * PI * interleaved_gradient_noise(gl_FragCoord.xy);
    vec3 irradiance = even_light * max(vec3(dot(light[0], n), dot(light[1], n), dot(light[2], n)), 0.0);
    float nv = max(dot(n, v), 0.02);
    irradiance *= goes_in_even(nv, m);
    vec3 specular = vec3(0.0);  // left out with DIFFUSE_ONLY
    float wet = a.x;
    for (int k = 0; k < lamps; ++k) {
        vec3 l = lamp_towards(k, world);
        float nl = dot(n, l), geometric = dot(smooth_n, l);
        if (geometric > -0.08 && nl > 0.0) {
            vec3 e = lamp_light(k, world) * nl * visibility(k, world, smooth_n, phase) * smoothstep(-0.08, 0.12, geometric);
            irradiance += e * goes_in(n, v, l, m);
#ifndef DIFFUSE_ONLY
            float lobe = (1.0 - lobe_share) * kelemen(n, v, l, m * lobe_roughness.x, f0) + lobe_share * kelemen(n, v, l, min(m * lobe_roughness.y, 0.9), f0);
            specular += e * lobe * (1.0 - 0.5 * min(shade, 1.0)) * (1.0 - 0.85 * b.w);
#endif
        }
    }
#ifndef DIFFUSE_ONLY
    // panels in the mirror direction, shadowed by the baked openness
    vec3 r = reflect(-v, n);
    float rough = m * 1.1;
    float occlusion = clamp(pow(nv + open_sky, exp2(-16.0 * rough - 1.0)) - 1.0 + open_sky, 0.0, 1.0);  // Lagarde and de Rousiers 2014
    float f = f0 + 0.30 * pow(1.0 - nv, 5.0) * (1.0 - rough);
    specular += environment(r, 2.0 / (rough * rough)) * f * (1.0 - 0.5 * min(shade, 1.0)) * occlusion * (1.0 - 0.9 * b.w);
#endif

    vec3 dark = mix(vec3(1.0), vec3(0.35), b.w);
    float mask = material_id * step(0.5, scatters);
    out_irradiance = vec4(irradiance * dark, mask);
    out_specular = vec4(strength * specular, 1.0);
    out_albedo = vec4(albedo, 1.0 - sent_back(nv, m));
    put_place(n);
#if DOMAIN != SCREEN
    vec3 through = vec3(0.0);
#ifndef DIFFUSE_ONLY
    for (int k = 0; k < lamps; ++k) through += transmitted(k, world, smooth_n);
#endif
    out_transmitted = vec4(mask > 0.0 ? through * (1.0 - b.w) : vec3(0.0), 1.0);
#endif
}
