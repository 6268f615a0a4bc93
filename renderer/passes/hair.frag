// Hair: Marschner et al. 2003's two highlights as Gaussian lobes over a diffuse term, doi:10.1145/882262.882345.
#include "shaders/common.glsl"
#include "shaders/lighting.glsl"
in vec3 world; in vec3 tangent; in vec3 albedo; in vec3 around; in float cover; in float opacity; in float lit[LAMPS];
uniform float extinction;  // of the whole layer along its normal
layout(location = 0) out vec4 premultiplied;

float lobe(float sine, float shift, float width) { float x = (sine - shift) / width; return exp(-0.5 * x * x) / (width * 2.5066); }

void main() {
    vec3 t = normalize(tangent), v = normalize(camera_position - world);
    float tv = dot(t, v);
    vec3 radiance = albedo * around / PI * exp(-0.8 * extinction * cover);
    for (int k = 0; k < lamps; ++k) {
        vec3 l = lamp_towards(k, world);
        float tl = dot(t, l);
        float diffuse = sqrt(max(1.0 - tl * tl, 0.0));
        float sum = tl + tv;
        vec3 scattered = albedo * diffuse * 0.55 / PI + vec3(0.011) * lobe(sum, 0.12, 0.14) + albedo * 0.11 * lobe(sum, -0.16, 0.24);
        radiance += lamp_light(k, world) * lit[k] * scattered;
    }
    premultiplied = vec4(radiance * opacity, opacity);
}
