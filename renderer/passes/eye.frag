// Eyeball: refracting cornea over a lit iris, veined sclera, one wet surface.
#include "shaders/common.glsl"
#include "shaders/noise.glsl"
#include "shaders/lighting.glsl"
#include "passes/surface_out.glsl"
uniform vec3 centre; uniform vec3 gaze; uniform float radius; uniform float iris_radius;
uniform vec3 iris_base; uniform vec3 iris_fibres; uniform vec3 iris_collarette; uniform vec3 sclera_colour;

void main() {
    vec3 n = normalize(world_normal);
    vec3 v = normalize(camera_position - world);
    float phase = 2.0 * PI * interleaved_gradient_noise(gl_FragCoord.xy);
    vec3 up = normalize(vec3(0.0, 1.0, 0.0) - gaze * gaze.y), side = cross(up, gaze);
    vec3 local = vec3(dot(world - centre, side), dot(world - centre, up), dot(world - centre, gaze));
    float rim = length(local.xy);

    // the ray bent into the aqueous humour meets the iris plane
    vec3 inside = refract(-v, n, 1.0 / 1.336);
    vec3 ray = vec3(dot(inside, side), dot(inside, up), dot(inside, gaze));
    float plane = sqrt(radius * radius - iris_radius * iris_radius) - 0.3;
    float t = (plane - local.z) / min(ray.z, -0.15);
    vec2 iris = (local + ray * max(t, 0.0)).xy / iris_radius;
    float r = length(iris), angle = atan(iris.y, iris.x);

    // iris: radial fibres, a warm collarette, a dark rim, the pupil
    float fibre = 0.0;
    vec2 around = vec2(cos(angle), sin(angle));
    fibre += 0.55 * noise(vec3(around * 13.0, r * 2.2)) + 0.35 * noise(vec3(around * 31.0, r * 3.5 + 4.0)) + 0.22 * noise(vec3(around * 60.0, r * 6.0));
    float pupil = 0.33;
    float collar = exp(-pow((r - 0.50 - 0.04 * noise(vec3(around * 5.0, 1.0))) / 0.11, 2.0));
    vec3 iris_colour = mix(iris_base, iris_fibres, clamp(0.5 + 0.8 * fibre, 0.0, 1.0));
    iris_colour = mix(iris_colour, iris_collarette, 0.65 * collar);
    iris_colour *= 1.0 - 0.20 * smoothstep(0.15, 0.85, noise(vec3(iris * 6.0, 3.0)));
    iris_colour *= mix(0.30, 1.0, smoothstep(1.02, 0.80, r));
    iris_colour *= smoothstep(pupil - 0.025, pupil + 0.035, r + 0.008 * noise(vec3(around * 8.0, 2.0)));

    // sclera: warm white, veins that fade towards the cornea
    vec3 sclera = sclera_colour * (1.0 + 0.03 * noise(local / 2.5));
    vec3 q = local / vec3(1.0, 1.0, 1.4);
    float vein = 0.0;
    for (int k = 0; k < 2; ++k) {
        float scale = k == 0 ? 3.1 : 1.5;
        vec3 bend = vec3(noise(q / 1.4), noise(q / 1.4 + 9.0), noise(q / 1.4 + 5.0));
        Cells c = cells(q / scale + 0.35 * bend + float(k) * 7.0);
        vein += (k == 0 ? 1.0 : 0.6) * smoothstep(0.055, 0.0, c.f2 - c.f1);
    }
    float outward = smoothstep(iris_radius * 1.15, iris_radius * 2.0, rim);
    sclera = mix(sclera, vec3(0.50, 0.16, 0.13), clamp(vein * 0.38 * outward * (0.4 + 0.6 * unit(hash3(ivec3(floor(q / 2.0))))), 0.0, 0.7));
    sclera = mix(sclera, sclera * vec3(1.0, 0.80, 0.76), 0.55 * outward);
    float limbus = smoothstep(iris_radius * 0.90, iris_radius * 1.10, rim + 0.12 * noise(local * 1.3));
    vec3 albedo = mix(iris_colour, sclera, limbus);
    albedo = mix(albedo, albedo * vec3(0.60, 0.60, 0.62), 1.0 - smoothstep(0.0, 0.9, abs(rim - iris_radius) / 0.9));

    vec3 irradiance = max(vec3(dot(light[0], n), dot(light[1], n), dot(light[2], n)), 0.0);
    vec3 specular = vec3(0.0);
    float f0 = 0.025;
    vec3 flat_n = gaze;
    for (int k = 0; k < lamps; ++k) {
        vec3 l = lamp_towards(k, world), light_here = lamp_light(k, world);
        float seen = visibility(k, world, n, phase);
        // the iris is lit through the cornea: flat, and brighter opposite the lamp (a cheap caustic)
        vec2 across = vec2(dot(l, side), dot(l, up));
        float focus = 1.0 + 0.9 * clamp(-dot(iris, across), -0.5, 1.0);
        float on_iris = max(dot(flat_n, l), 0.0) * focus, on_white = smoothstep(-0.25, 1.0, dot(n, l));
        irradiance += light_here * seen * mix(on_iris, on_white, limbus);
        specular += seen * schlick(f0, max(dot(n, v), 0.02)) * lamp_mirrored(k, world, reflect(-v, n), 0.03);
    }
    vec3 r_dir = reflect(-v, n);
    float nv = max(dot(n, v), 0.02);
    specular += environment(r_dir, 400.0) * schlick(f0, nv) * smoothstep(0.05, 0.45, open_sky);
    // the tear film thickens where the lids meet the eye
    float lid = smoothstep(0.62, 0.15, open_sky);
    specular *= 1.0 - 0.6 * lid;
    irradiance *= mix(1.0, 0.55, lid);
    out_irradiance = vec4(irradiance, 0.0);
    out_specular = vec4(specular, 1.0);
    out_albedo = vec4(albedo, 1.0);
    put_place(n);
}
