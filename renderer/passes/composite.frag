// Scattered irradiance to radiance, specular on top, hair over it, a studio backdrop behind; tone mapped, still linear.
#include "shaders/common.glsl"
#include "shaders/screen.glsl"
#include "shaders/environment.glsl"
uniform sampler2D scattered; uniform sampler2D specular; uniform sampler2D albedo; uniform sampler2D depths;
uniform float exposure; uniform float saturation; uniform float power;
uniform float conserving;  // 1: what the face sends back inside does not get out
uniform float texturing;  // the power of the albedo that is in the scattered light already
// TONE_MAP and BACKDROP are places in the lists of renderer/scene/picture.py: constants, since software drivers take every branch.
uniform mat3 rays;                           // normalised device coordinates to directions in the world
uniform vec3 backdrop_centre; uniform vec3 backdrop_edge;
uniform float aspect;
uniform int scattered_row;  // of what is drawn, in the scattered light
uniform sampler2D bare;     // specular light without hair over it
uniform float white;        // luminance of scattered light at which it is whole; 0: it always is
out vec4 colour;

// Narkowicz 2016, "ACES filmic tone mapping curve".
vec3 filmic(vec3 x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }

// Hable 2010, "Uncharted 2: HDR lighting": white at 11.2.
vec3 hable_curve(vec3 x) { return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.50) + 0.06) - 0.02 / 0.30; }
vec3 hable(vec3 x) { return hable_curve(2.0 * x) / hable_curve(vec3(11.2)); }

// Sobotka's AgX; see renderer/scene/picture.py for the numbers and their sources.
uniform mat3 agx_in; uniform mat3 agx_out; uniform mat3 from_rec2020; uniform vec2 agx_stops;
vec3 agx(vec3 x) {
    x = clamp((log2(max(agx_in * max(x, 0.0), 1e-10)) - agx_stops.x) / (agx_stops.y - agx_stops.x), 0.0, 1.0);
    x = ((((((15.5 * x - 40.14) * x + 31.96) * x - 6.868) * x + 0.4298) * x + 0.1191) * x) - 0.00232;
    return from_rec2020 * pow(max(agx_out * x, 0.0), vec3(2.2));
}

// Khronos 2024, "PBR Neutral tone mapper".
vec3 neutral(vec3 x) {
    const float start = 0.8 - 0.04;
    float least = min(x.r, min(x.g, x.b));
    x -= least < 0.08 ? least - 6.25 * least * least : 0.04;
    float peak = max(x.r, max(x.g, x.b));
    if (peak < start) return x;
    float now = 1.0 - (1.0 - start) * (1.0 - start) / (peak + 1.0 - 2.0 * start);
    float share = 1.0 / (0.15 * (peak - now) + 1.0);
    return mix(vec3(now), x * now / peak, share);
}

vec3 toned(vec3 x) {
#if TONE_MAP == 0
    x = filmic(x);
#elif TONE_MAP == 1
    x = hable(x);
#elif TONE_MAP == 3
    x = agx(x);
#elif TONE_MAP == 4
    x = neutral(x);
#endif
    x = clamp(x, 0.0, 1.0);
    if (saturation != 1.0) x = clamp(mix(vec3(dot(x, vec3(0.2126, 0.7152, 0.0722))), x, saturation), 0.0, 1.0);
    return power == 1.0 ? x : pow(x, vec3(power));
}

vec3 behind() {
    vec2 uv = image_pixel() / image_size;
    vec2 d = (uv - vec2(0.5, 0.52)) * vec2(aspect, 1.0);
#if BACKDROP == 0
    return mix(backdrop_centre, backdrop_edge, smoothstep(0.0, 1.0, length(d)));
#else
    return environment(normalize(rays * vec3(uv * 2.0 - 1.0, 1.0)), 4096.0);
#endif
}

void main() {
    ivec2 at = ivec2(image_pixel());
    float depth = texelFetch(depths, at, 0).x;
    vec4 over = texelFetch(specular, at, 0);  // highlights under hair, and what hair hides
    vec3 radiance = behind();
    if (depth > 0.0) {
        vec4 face = texelFetch(albedo, at, 0);
        vec3 own = max(face.rgb, 0.0);
        vec3 left = texturing == 0.0 ? own : pow(max(own, 1e-6), vec3(1.0 - texturing));
        vec4 light = texelFetch(scattered, ivec2(gl_FragCoord.xy) + ivec2(0, scattered_row), 0);
        if (white > 0.0 && light.a > 0.5) {
            vec3 blurred = light.rgb / (texturing == 0.0 ? vec3(1.0) : pow(max(own, 1e-6), vec3(texturing)));
            float share = clamp(dot(blurred, vec3(0.2125, 0.7154, 0.0721)) / white, 0.0, 1.0);
            over.rgb -= (1.0 - share) * (1.0 - over.a) * texelFetch(bare, at, 0).rgb;
        }
        radiance = (light.a > 0.5 ? left : own) * mix(1.0, face.a, conserving) * light.rgb / PI;
    }
    radiance = radiance * (1.0 - over.a) + over.rgb;
    colour = vec4(toned(exposure * radiance), 1.0);
}
