// Skin: colour and relief (procedural, from maps, or the one over the other), lamps, baked environment.
#include "shaders/common.glsl"
#include "shaders/noise.glsl"
#include "shaders/lighting.glsl"
#include "shaders/diffuse.glsl"
#include "passes/surface_out.glsl"
#include "passes/lids.glsl"
#include "passes/lid_margin.glsl"
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
uniform sampler2D skin_table;        // log albedo: columns blood, rows melanin, one block of rows a thickness (renderer/optics/skin.py)
uniform vec2 skin_most; uniform float skin_thinnest; uniform float skin_blocks;
uniform float melanin; uniform float blood; uniform float flush; uniform float mottling; uniform vec2 uneven;
uniform float eyelid_blood; uniform float eyelid_epidermis; uniform vec2 lip_blood; uniform float lip_melanin; uniform float lip_melanin_inner; uniform float lip_epidermis;
uniform float lip_haze; uniform vec3 lip_haze_colour; uniform float lip_ragged;
uniform float freckles; uniform float freckle_share; uniform float spots; uniform float spot_share; uniform vec2 spots_mm; uniform float red_spots; uniform float red_share; uniform float moles; uniform float mole_share; uniform float vessels; uniform float veins;
uniform float beard_tint; uniform float scalp_tint; uniform float scalp_from; uniform vec3 scalp_left; uniform vec3 rooted_left; uniform vec3 shaven_left; uniform vec3 inside_left;
uniform float pore_darkness; uniform vec2 micro_mm; uniform vec3 bumps_mm;
uniform float f0_oily; uniform float roughness_lips; uniform float lobe_share_oily; uniform float oil_patches;
uniform float pore_depth; uniform float furrow_depth; uniform float bump_height; uniform float wrinkle_depth; uniform float lip_folds;
uniform float roughness_dry; uniform float roughness_oily;
// Where wrinkles lie, mm (renderer/scene/material.py): vec4 and vec2 say where they set in, are whole, begin to end, have ended.
uniform vec4 forehead_lines; uniform vec2 forehead_lines_half; uniform float forehead_lines_period; uniform float forehead_lines_width;
uniform vec2 crows_feet_place; uniform vec4 crows_feet; uniform vec2 crows_feet_angle;
uniform vec4 lid_lines; uniform vec2 lid_lines_half; uniform float lid_lines_period;
uniform vec2 wrinkles_behind;  // the eyes: on the forehead, around the eyes
uniform float material_id;           // 1, 2, ...: which medium scatters below; 0: none
uniform float even_light;           // 1, or 0: what the environment and other surfaces send is left out
uniform vec3 noise_origin;           // mm: the seed's place in the solid noise

float fade(float size_mm, float pixel_mm) { float r = pixel_mm / size_mm; return 1.0 / (1.0 + 6.0 * r * r); }

// What of the relief a pixel still shows, and what the rest adds to the mirror's roughness: slopes of a mean square are lost.
struct Relief { vec4 h; vec3 fine; float pore; float lost; };
void lose(inout Relief r, float mean_square, float shown) { r.lost += mean_square * (1.0 - shown * shown); }

// The nearest feature point, of those within half a cell: what small spots need, at a third of the price of `cells`. Spots and pores
// are drawn out along the surface's normal, or a plane would meet few of them: offsets along it count DRAWN_OUT.
struct Spot { float f1; vec3 d1; uint id; };
const float DRAWN_OUT = 0.45;
vec3 inwards;  // the smooth surface's normal in the object's axes
Spot spot(vec3 p) {
    ivec3 base = ivec3(floor(p - 0.5));
    Spot s; s.f1 = 9.0; s.d1 = vec3(0.0); s.id = 0u;
    for (int k = 0; k < 8; ++k) {
        ivec3 c = base + ivec3(k & 1, (k >> 1) & 1, k >> 2);
        uint h = hash3(c);
        vec3 d = p - (vec3(c) + 0.1 + 0.8 * unit3(h));
        d -= (1.0 - DRAWN_OUT) * dot(d, inwards) * inwards;
        float q = dot(d, d);
        if (q < s.f1) { s.f1 = q; s.d1 = d; s.id = h; }
    }
    s.f1 = sqrt(s.f1);
    return s;
}

float lip_of(float mask) { return smoothstep(0.0, 0.6, mask); }         // how much of lip there is, 0.5 in the mask being its border
// The mask of the lips with the ragged border that vermilion has against the skin.
float lip_mask(vec3 q) {
    if (a.x <= 0.0 || lip_ragged <= 0.0) return a.x;
    float wander = 0.7 * noise(q / 2.3 + 13.0) + 0.7 * noise(q / 0.9 + 29.0);
    return clamp(a.x + lip_ragged * wander * smoothstep(0.0, 0.3, a.x) * (1.0 - smoothstep(0.6, 0.95, a.x)), 0.0, 1.0);
}
float seam_of(float mask) { return clamp(2.0 * mask - 1.0, 0.0, 1.0); }  // how near the seam

// Furrows between cells of 0.62 mm that are squashed along an axis, so that most run across it. Real ones follow the skin's tension.
void furrows(inout Relief r, vec3 q, mat3 net, float deep, float shown, float weight) {
    Cells g = cells(net * q / 0.62 + 31.7);
    float gap = g.f2 - g.f1, wide = 0.17;
    float f = exp(-gap * gap / (wide * wide));
    vec3 d = transpose(net) * (g.d2 / max(g.f2, 1e-3) - g.d1 / max(g.f1, 1e-3));
    r.h.x -= weight * deep * shown * f;
    r.h.yzw += weight * deep * shown * f * 2.0 * gap / (wide * wide) * d / 0.62;
}

// Noise over 1.6, 4.1 and 11 mm, with its gradient: bumps, and the blood below them.
struct Waves { vec4 fine; vec4 middle; vec4 broad; };
const vec3 WAVES_MM = vec3(1.6, 4.1, 11.0);
Waves waves_at(vec3 q) {
    return Waves(value_noise(q / WAVES_MM.x), value_noise(q / WAVES_MM.y + 7.0), value_noise(q / WAVES_MM.z + 3.0));
}

// Pores, furrows, bumps and wrinkles at p: height in mm and its gradient.
Relief relief(vec3 p, float pixel_mm, Waves waves) {
    float lips = lip_of(lip_mask(p + noise_origin)), eyelid = a.w, pores = b.x, inside = b.w;
    vec3 q = p + noise_origin;
    Relief r; r.h = vec4(0.0); r.fine = vec3(0.0); r.pore = 0.0; r.lost = 0.0;
    float skin = (1.0 - lips) * (1.0 - inside);

    // pores: two sizes of pits, of depths of their own, missing here and there
    for (int k = 0; k < 2; ++k) {
        float size = k == 0 ? 0.92 : 0.60, w = k == 0 ? 0.22 : 0.18, shown = fade(size * 0.5, pixel_mm);
        Spot c = spot(q / size);
        float own = unit(mix_bits(c.id ^ 0x51u));
        own = own * step(0.15, own);
        float depth = pore_depth * (k == 0 ? 0.080 : 0.040) * pores * own * skin;
        float e = exp(-c.f1 * c.f1 / (w * w));
        r.h.x -= shown * depth * e;
        r.h.yzw += shown * depth * e * 2.0 / (w * w) * c.d1 / size;
        r.pore += (k == 0 ? 1.0 : 0.6) * mix(7.2 * w * w * w, pow(e, 1.4), shown) * own * pores * skin;
        float steep = pore_depth * (k == 0 ? 0.080 : 0.040) * pores * skin / size;
        lose(r, 4.2 * w * steep * steep, shown);
    }
    // three fixed nets of furrows, by region: across on forehead and neck, down and outwards on cheeks, upright about the mouth
    float deep = furrow_depth * 0.030 * skin * (1.0 - 0.6 * pores) * (1.0 - 0.5 * eyelid), shown = fade(0.5, pixel_mm);
    lose(r, 54.0 * deep * deep, shown);
    if (deep * shown > 1e-4) {
        vec3 between = 0.5 * (eye_l + eye_r), off = p - between;
        float side = abs(off.x), up = off.y;
        float across = eye_l == eye_r ? 1.0 : max(smoothstep(8.0, 24.0, up), 1.0 - smoothstep(-122.0, -104.0, up));
        float slanted = (1.0 - across) * smoothstep(10.0, 26.0, side), upright = 1.0 - across - slanted;
        float s = off.x < 0.0 ? -0.5 : 0.5;  // sine of 30 degrees, outwards on either side
        mat3 slant = mat3(1.35 * 0.866, 0.62 * -s, 0.0, 1.35 * s, 0.62 * 0.866, 0.0, 0.0, 0.0, 1.0);
        if (across > 0.02) furrows(r, q, mat3(0.60, 0.0, 0.0, 0.0, 1.40, 0.0, 0.0, 0.0, 1.0), deep, shown, across);
        if (slanted > 0.02) furrows(r, q, slant, deep, shown, slanted);
        if (upright > 0.02) furrows(r, q, mat3(1.35, 0.0, 0.0, 0.0, 0.70, 0.0, 0.0, 0.0, 1.0), deep, shown, upright);
    }
    // finer relief that only the mirror sees
    float rough = (1.0 - inside) * (1.0 - 0.5 * lips) * (0.7 + 0.3 * pores);
    for (int k = 0; k < 2; ++k) {
        float size = k == 0 ? 0.62 : 0.34, steep = rough * (k == 0 ? micro_mm.x : micro_mm.y) / size, seen = fade(size * 0.7, pixel_mm);
        lose(r, 1.17 * steep * steep, seen);
        if (seen > 0.08) r.fine += steep * seen * value_noise(q / size + 5.0 * float(k)).yzw;
    }
    vec4 h = r.h;
    // bumps of 1.6, 4.1 and 11 mm
    float seen = fade(1.0, pixel_mm);
    vec3 high = bump_height * bumps_mm * vec3(skin * seen, skin, (1.0 - inside) * (1.0 - 0.6 * lips)), rise = high / WAVES_MM;
    h += vec4(high.x * waves.fine.x + high.y * waves.middle.x + high.z * waves.broad.x,
        rise.x * waves.fine.yzw + rise.y * waves.middle.yzw + rise.z * waves.broad.yzw);
    lose(r, 1.17 * pow(bump_height * bumps_mm.x * skin / WAVES_MM.x, 2.0), seen);

    // forehead: soft lines that wander and break off, each where it likes
    vec3 eyes = 0.5 * (eye_l + eye_r);
    vec3 f = p - eyes;
    float brow = smoothstep(forehead_lines.x, forehead_lines.y, f.y) * (1.0 - smoothstep(forehead_lines.z, forehead_lines.w, f.y))
        * (1.0 - smoothstep(forehead_lines_half.x, forehead_lines_half.y, abs(f.x))) * step(0.0, p.z - eyes.z + wrinkles_behind.x);
    if (brow > 0.0) {
        float period = forehead_lines_period, w = forehead_lines_width;
        float y = f.y + 3.4 * noise(vec3(q.x / 22.0, q.y / 34.0, 2.0)) + 0.9 * waves.broad.x, line = floor(y / period);
        float s = (fract(y / period) - 0.5) * period + 0.2 * period * noise(vec3(q.x / 60.0, line * 5.3, 8.0));
        float strength = smoothstep(-0.25, 0.55, noise(vec3(q.x / 14.0, line * 3.1, 5.0)) + 0.35 * waves.middle.x);
        float g = exp(-s * s / (w * w)) * wrinkle_depth * 0.060 * strength * brow;
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
    // lips: upright grooves that fan out, wide and narrow ones, of depths of their own that come and go; and the small plates between
    if (lips > 0.01) {
        vec2 d = vec2(p.x - mouth.x, (p.y - mouth.y) * 0.35);
        float bend = 0.10 * d.x * noise(q / 6.0) + 0.75 * noise(q / vec3(1.8, 3.4, 1.8)) + 1.2 * noise(q / vec3(4.5, 9.0, 4.5));
        for (int k = 0; k < 2; ++k) {
            float period = k == 0 ? 1.55 : 0.62, deep = lip_folds * (k == 0 ? 0.090 : 0.035) * lips, held = fade(0.65 * period, pixel_mm);
            float s = d.x + bend * (k == 0 ? 1.0 : 0.7) + 0.31 * float(k), wave = 2.0 * PI / period, g = 0.5 + 0.5 * cos(s * wave);
            float own = 0.35 + 0.95 * noise(vec3(floor(s / period + 0.5) * 3.7, q.y / 2.6, 2.0 + 7.0 * float(k)));
            float amp = deep * clamp(own, 0.0, 1.0) * held;
            h.x -= amp * pow(g, 5.0);
            h.y += amp * 5.0 * g * g * g * g * 0.5 * sin(s * wave) * wave;
            lose(r, 0.05 * deep * deep * wave * wave, held);
        }
        float plates = fade(0.7, pixel_mm);
        if (plates > 0.1) {
            Cells c = cells(q * vec3(1.0, 0.75, 1.0) / 0.95 + 11.0);
            float gap = c.f2 - c.f1, f = exp(-gap * gap / 0.03);
            vec3 across = c.d2 / max(c.f2, 1e-3) - c.d1 / max(c.f1, 1e-3);
            h.yzw += lip_folds * 0.020 * plates * lips * f * 2.0 * gap / 0.03 * across / 0.95;
        }
    }
    r.h = h;
    return r;
}

vec3 skin_colour(float m, float h, float thickness) {
    vec2 n = vec2(textureSize(skin_table, 0));
    float rows = n.y / skin_blocks;
    vec2 at = sqrt(clamp(vec2(h, m) / skin_most, 0.0, 1.0)) * (vec2(n.x, rows) - 1.0) + 0.5;
    float block = clamp((thickness - skin_thinnest) / (1.0 - skin_thinnest), 0.0, 1.0) * (skin_blocks - 1.0);
    float low = min(floor(block), skin_blocks - 2.0);
    vec3 thin = texture(skin_table, vec2(at.x, at.y + rows * low) / n).rgb;
    vec3 thick = texture(skin_table, vec2(at.x, at.y + rows * (low + 1.0)) / n).rgb;
    return exp(mix(thin, thick, block - low));
}

// A spot with a ragged border: its height in mm and gradient, as of a dome, times how much of it there is.
float ragged(vec3 q, float f1, float radius, float size) {
    return 1.0 - smoothstep(0.62 * radius, radius, f1 + 0.30 * radius * noise(q / (0.5 * size)) + 0.16 * radius * noise(q / (0.21 * size) + 9.0));
}

// Moles stand out of the skin: adds to the relief; returns how much of a mole there is.
float mole_at(vec3 q, float skin, inout vec3 gradient) {
    if (moles * layer_moles <= 0.0 || mole_share <= 0.0) return 0.0;
    Spot c = spot(q / 31.0 + 3.0);
    if (unit(mix_bits(c.id ^ 7u)) < 1.0 - mole_share) return 0.0;
    float radius = mix(0.018, 0.040, unit(mix_bits(c.id ^ 11u))), r = c.f1 / radius;
    if (r > 1.5) return 0.0;
    float e = exp(-2.5 * r * r) * step(0.45, unit(mix_bits(c.id ^ 13u)));  // half of them are flat
    gradient -= 0.30 * skin * e * 5.0 * c.d1 / (radius * radius * 31.0);
    return layer_moles * skin * ragged(q, c.f1, radius, 31.0 * radius);
}

// Skin colour: how much melanin and blood there is, and how thick the epidermis is above it, looked up in the spectral model; over an
// albedo map the model says by how much more of them darken what it shows.
vec3 colour(vec3 p, float pixel_mm, float pore, float mole, Waves waves, bool mapped, vec3 map) {
    float rim = lip_mask(p + noise_origin), lips = lip_of(rim), inner = seam_of(rim), flushed = a.y, hair = a.z, eyelid = a.w, beard = beard_tint * b.z, inside = b.w;
    vec3 q = p + noise_origin;
    if (mapped) { lips = 0.0; inner = 0.0; flushed = 0.0; eyelid = 0.0; }
    float broad = noise(q / 24.0), patchy = noise(q / 9.0 + 4.0), small = noise(q / 3.2 + 40.0), fine = noise(q / 1.3 + 2.0) * fade(0.9, pixel_mm);
    float red = noise(q / 21.0 + 21.0), tiny = noise(q / 0.9 + 77.0) * fade(0.6, pixel_mm);
    float blotched = 0.30 * red + 0.30 * waves.broad.x + 0.45 * waves.middle.x + 0.65 * waves.fine.x * fade(1.0, pixel_mm) + 0.55 * tiny;
    // layer_mottling: how even it is; over a map all of this is the map's own
    float m = melanin * (mapped ? 1.0 : max(1.0 + uneven.x * (0.50 * broad + 0.65 * patchy + 0.80 * small + 0.85 * fine), 0.2));
    float h = blood + flush * flushed * max(1.0 + 0.5 * uneven.y * (red + patchy), 0.0) + eyelid_blood * eyelid;
    float varied = uneven.y * (0.5 + 0.5 * flushed);
    if (!mapped) h *= exp(varied * blotched - 0.09 * varied * varied);  // 1 on average
    float thickness = mix(1.0, eyelid_epidermis, max(eyelid, 0.7 * min(flushed, 1.0)));  // where blood shows, it lies nearer
    float m0 = m, h0 = h;
    // capillary mottling, strongest where the skin is flushed
    float mottled = 0.6 * waves.middle.x + 0.6 * small + 0.5 * fine + 0.4 * tiny;
    h += layer_mottling * mottling * (0.003 + 0.012 * flushed) * 1.6 * max(mottled, 0.0) * (1.0 - lips);
    // fine vessels where it is flushed most
    float webbed = vessels * layer_mottling * smoothstep(0.55, 0.95, flushed + 0.25 * patchy) * fade(0.35, pixel_mm) * (1.0 - lips);
    if (webbed > 0.004) {
        Cells v = cells((q + 0.55 * vec3(small, fine, patchy)) / 2.6 + 50.0);
        float broken = smoothstep(-0.1, 0.5, noise(q / 1.9 + 33.0));
        h += webbed * broken * exp(-pow((v.f2 - v.f1) / 0.055, 2.0));
    }
    // veins below temple and neck, where the epidermis lies over little else
    float vein = 0.0;
    if (veins * layer_mottling > 0.0 && eye_l != eye_r && !mapped) {
        vec3 off = p - 0.5 * (eye_l + eye_r);
        float side = abs(off.x);
        float there = max(smoothstep(46.0, 56.0, side) * smoothstep(-4.0, 6.0, off.y) * (1.0 - smoothstep(36.0, 58.0, off.y)), 1.0 - smoothstep(-124.0, -108.0, off.y));
        there *= smoothstep(0.0, 0.35, noise(q / 17.0 + 15.0)) * (1.0 - hair);
        if (there > 0.02) {
            Cells v = cells((q + vec3(5.0 * patchy, 5.0 * red, 5.0 * broad)) * vec3(1.0, 0.6, 1.0) / 30.0 + 70.0);
            vein = there * exp(-pow((v.f2 - v.f1) / 0.06, 2.0));
        }
    }
    // freckles in clusters, most where the sun falls and blood shows: many are faint and few are dark
    float bare = layer_freckles * (1.0 - lips);
    Spot c = spot(q / 3.4);
    float one = unit(mix_bits(c.id ^ 3u)), of = unit(mix_bits(c.id ^ 5u));
    float clustered = smoothstep(-0.45, 0.45, broad + 0.6 * patchy);
    if (bare > 0.0 && one > 1.0 - freckle_share * (0.3 + 0.7 * clustered) * (0.5 + 0.5 * flushed) && c.f1 < 0.34)
        m += bare * freckles * (0.25 + 0.75 * of) * ragged(q, c.f1, mix(0.07, 0.19, of), 0.6);
    // a few larger spots: brown ones with a ragged border, red ones that fade out
    if (bare * spot_share > 0.0) {
        c = spot(q / 9.0 + 5.0);
        one = unit(mix_bits(c.id ^ 17u)); of = unit(mix_bits(c.id ^ 19u));
        float radius = mix(spots_mm.x, spots_mm.y, of * of) / 18.0;
        if (one > 1.0 - spot_share && c.f1 < 2.2 * radius) {
            if (unit(mix_bits(c.id ^ 23u)) < red_share) h += bare * red_spots * (0.5 + 0.5 * of) * exp(-2.0 * c.f1 * c.f1 / (radius * radius));
            else m += bare * spots * (1.0 - 0.5 * of) * ragged(q, c.f1, radius, 9.0 * radius);
        }
    }
    m += moles * mole;
    // lips: redder towards the seam, under a thin epidermis
    float vermilion = mix(lip_blood.x, lip_blood.y, inner) * (1.0 + 0.20 * patchy + 0.22 * small + 0.16 * fine);
    m *= mix(1.0, lip_melanin * mix(1.0, lip_melanin_inner, inner), lips);
    h = mix(h, vermilion, lips);
    thickness = mix(thickness, lip_epidermis, lips);
    // hair below the surface: scalp and shaven beard, dots that merge with distance
    hair = layer_hair * smoothstep(scalp_from, 1.0, hair);  // before the line hairs are too few to tint the skin
    beard *= layer_hair;
    float rooted = hair * (0.75 + 0.25 * noise(q / 4.0)), shaven = beard * (1.0 - hair) * clamp(0.75 + 0.35 * patchy + 0.35 * waves.middle.x, 0.0, 1.2), dots = 0.05;
    if (max(rooted, shaven) > 0.02) {
        Spot d = spot(q / 0.62 + 8.0);
        dots = mix(0.05, 1.0 - smoothstep(0.10, 0.24, d.f1), fade(0.45, pixel_mm));
    }
    vec3 skin = skin_colour(m / thickness, h, thickness);  // melanin lies at the epidermis's base: a thin one has as much of it
    // the dry surface and slow blood dull the vermilion, in patches and most outside; wet inside it stays red
    float dull = lip_haze * lips * clamp(1.0 + 0.20 * small + 0.20 * fine - 0.5 * inner, 0.0, 2.0);
    skin = mix(skin, dot(skin, vec3(0.2126, 0.7152, 0.0722)) * lip_haze_colour, min(dull, 1.0));
    if (mapped) skin = map * skin / skin_colour(m0 / thickness, h0, thickness);
    skin *= mix(vec3(1.0), scalp_left, hair * scalp_tint) * (1.0 - rooted * rooted_left - shaven * shaven_left - 0.45 * dots * max(rooted, 0.75 * shaven));
    skin *= 1.0 - pore_darkness * vec3(0.85, 1.0, 1.1) * min(pore, 1.0);  // what is in them is brownish
    skin *= 1.0 - veins * layer_mottling * vein * vec3(0.13, 0.06, 0.02);  // red goes deepest, and is missing most (Kienle et al. 1996)
    return mapped ? skin : skin * mix(vec3(1.0), inside_left, inside);
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
// Two lobes of Beckmann slopes: roughness of each, the share of the second, reflectance at normal incidence.
vec2 lobes; float second; float normal_f0;

// The share of the light that the two lobes send back, of light from a direction or from everywhere.
float sent_back(vec3 one, vec3 two) {
    float back = mix(dot(vec2(normal_f0, 1.0), one.xy), dot(vec2(normal_f0, 1.0), two.xy), second);
    return clamp(strength * back, 0.0, 1.0);
}
float sent_back(float cosine) { return sent_back(face(cosine, lobes.x), face(cosine, lobes.y)); }
float sent_back_even() { return sent_back(face_even(lobes.x), face_even(lobes.y)); }
// What of a lamp's light goes in, and what of even light. Over an atlas or points nobody looks on.
float goes_in(vec3 n, vec3 v, vec3 l, float m) {
#if DIFFUSE == DISNEY
    float lh = dot(l, normalize(l + v)), f90 = 0.5 + 2.0 * m * lh * lh;
    return (1.0 + (f90 - 1.0) * pow(1.0 - max(dot(n, l), 0.0), 5.0)) * (1.0 + (f90 - 1.0) * pow(1.0 - max(dot(n, v), 0.0), 5.0));
#elif DIFFUSE == CONSERVING
    return 1.0 - sent_back(max(dot(n, l), 0.0));
#else
    return 1.0;
#endif
}
float goes_in_even(float nv, float m) {
#if DIFFUSE == DISNEY
    return face(nv, m).z;
#elif DIFFUSE == CONSERVING
    return 1.0 - sent_back_even();
#else
    return 1.0;
#endif
}

#ifndef DIFFUSE_ONLY
// The share of a lobe of slope m about r that the open sky takes in: two cones' common solid angle (Oat and Sander 2007, "Ambient
// aperture lighting", doi:10.1145/1230100.1230111) over the lobe's, whose cone is that of Jimenez et al. 2016, "Practical real-time strategies
// for accurate indirect occlusion". A cone about the normal of half angle a lets a share sin(a)^2 of even light in.
float taken_in(vec3 r, float m) {
    float open = asin(sqrt(clamp(open_sky, 0.0, 1.0))), wide = acos(exp2(-3.32193 * m * m));
    float length2 = dot(sky, sky);
    float apart = length2 > 1e-8 ? acos(clamp(dot(r, sky) * inversesqrt(length2), -1.0, 1.0)) : 0.0;
    float least = min(open, wide), more = max(open, wide);
    float share = 1.0 - smoothstep(0.0, 1.0, (apart - (more - least)) / max(2.0 * least, 1e-4));
    return share * (1.0 - cos(least)) / max(1.0 - cos(wide), 1e-6);
}
#endif

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
    float shade = 0.0, mole = 0.0, lost = 0.0;
    second = lobe_share; normal_f0 = f0;
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
    vec3 mirror = n;
    if (procedural == 1) {
        inwards = normalize(smooth_n * mat3(model));
        Waves waves = waves_at(local + noise_origin);
        if (layer_relief > 0.0 || layer_moles > 0.0) {
            vec3 raised = vec3(0.0);
            mole = mole_at(local + noise_origin, (1.0 - lip_of(a.x)) * (1.0 - b.w), raised);
            Relief r; r.h = vec4(0.0); r.fine = vec3(0.0); r.pore = 0.0; r.lost = 0.0;
            if (layer_relief > 0.0) r = relief(local, pixel_mm, waves);
            shade = min(r.pore, 1.0);
            lost = r.lost;
            vec3 slope = mat3(model) * (r.h.yzw + raised) / length(model[0].xyz);  // relief grows with its object
            vec3 finer = slope + mat3(model) * r.fine / length(model[0].xyz);
            mirror = normalize(n - (finer - n * dot(finer, n)));
            n = normalize(n - (slope - n * dot(slope, n)));
        }
        albedo = colour(local, pixel_mm, shade, mole, waves, has_albedo_map == 1, albedo);
        if (layer_oil > 0.0) {
            vec3 q = local + noise_origin;
            float patches = 0.45 * noise(q / 21.0 + 91.0) + 0.40 * noise(q / 7.0 + 87.0) + 0.45 * noise(q / 2.0 + 83.0) * fade(1.4, pixel_mm);
            float lips = lip_of(lip_mask(q));
            float oil = clamp(b.y * (1.0 + oil_patches * patches) - 0.35 * shade, 0.0, 1.0);
            m = mix(mix(roughness_dry, roughness_oily, oil), roughness_lips * mix(1.15, 0.85, seam_of(a.x)), lips);
            second = mix(mix(lobe_share, lobe_share_oily, oil), lobe_share_oily, lips);
            normal_f0 = mix(f0, f0_oily, max(oil, 0.0));
        }
    }
    to_margin(local, local + noise_origin, albedo, m);
    if (has_roughness_map == 1) m = clamp(map_at(roughness_map, uv).r, 0.12, 0.9);
    // What is too fine for a pixel widens the lobes: slopes of a mean square s add s to m^2. The smooth surface's own turn within a pixel
    // does so too (Tokuyoshi and Kaplanyan 2019).
    float bend = lost;
#if DOMAIN == SCREEN
    vec3 turn_x = dFdx(smooth_n), turn_y = dFdy(smooth_n);
    bend += min(0.5 * (dot(turn_x, turn_x) + dot(turn_y, turn_y)), 0.18);
#endif
    lobes = clamp(sqrt(m * m * lobe_roughness * lobe_roughness + bend), 0.03, 0.9);
    strength = specular_strength;
    if (has_specular_map == 1) strength *= map_at(specular_map, uv).r;
    if (procedural == 1) strength *= 1.0 - scalp_tint * layer_hair * smoothstep(0.2, 0.9, a.z);  // roots stand where a scalp would shine
#if DOMAIN == SCREEN
    if (dot(n, v) < 0.02) n = normalize(n + v * (0.02 - dot(n, v)));
    if (dot(mirror, v) < 0.02) mirror = normalize(mirror + v * (0.02 - dot(mirror, v)));
#endif

    float phase = 2.0 * PI * interleaved_gradient_noise(gl_FragCoord.xy);
    vec3 irradiance = even_light * max(vec3(dot(light[0], n), dot(light[1], n), dot(light[2], n)), 0.0);
    float nv = max(dot(n, v), 0.02);
    irradiance *= goes_in_even(nv, m);
    vec3 specular = vec3(0.0);  // left out with DIFFUSE_ONLY
    float shown = (1.0 - 0.8 * shade) * (1.0 - 0.85 * b.w);
    for (int k = 0; k < lamps; ++k) {
        vec3 l = lamp_towards(k, world);
        float facing = lamp_facing(k, world, n), geometric = dot(smooth_n, l), below = -lamp_sine(k, world);
#ifdef DIFFUSE_ONLY
        float mirrors = 0.0;
#else
        float mirrors = lamp_facing(k, world, mirror);
#endif
        if (geometric > below - HORIZON && max(facing, mirrors) > 0.0) {
            vec3 e = lamp_light(k, world) * visibility(k, world, smooth_n, phase) * smoothstep(below - HORIZON, below + 0.12, geometric);
            if (facing > 0.0) irradiance += e * facing * goes_in(n, v, l, m);
#ifndef DIFFUSE_ONLY
            vec2 wide = sqrt(lobes * lobes + lamp_spread(k, world));
            if (mirrors > 0.0) specular += e * mirrors * shown * mix(kelemen(mirror, v, l, wide.x, normal_f0), kelemen(mirror, v, l, wide.y, normal_f0), second);
#endif
        }
    }
#ifndef DIFFUSE_ONLY
    // the environment in the mirror's direction through each lobe, as far as the cone of open sky takes it in
    vec3 r = reflect(-v, mirror);
    float mv = max(dot(mirror, v), 0.02);
    for (int k = 0; k < 2; ++k) {
        float rough = k == 0 ? lobes.x : lobes.y;
        float occlusion = taken_in(r, rough);
        float back = dot(vec2(normal_f0, 1.0), face(mv, rough).xy);
        specular += (k == 0 ? 1.0 - second : second) * environment(r, 2.0 / (rough * rough)) * back * shown * occlusion;
    }
#endif

    vec3 dark = mix(vec3(1.0), vec3(0.35), b.w);
    float mask = material_id * step(0.5, scatters);
    out_irradiance = vec4(irradiance * dark, mask);
    out_specular = vec4(strength * specular, 1.0);
    out_albedo = vec4(albedo, 1.0 - sent_back(nv));
    put_place(n);
#if DOMAIN != SCREEN
    vec3 through = vec3(0.0);
#ifndef DIFFUSE_ONLY
    for (int k = 0; k < lamps; ++k) through += transmitted(k, world, smooth_n);
#endif
    out_transmitted = vec4(mask > 0.0 ? through * through_flesh(local, a.x, b.w) : vec3(0.0), 1.0);
#endif
}
