// Scattered irradiance to radiance, specular on top, hair over it, a studio backdrop behind; tone mapped, still linear.
#include "shaders/common.glsl"
in vec2 uv;
uniform sampler2D scattered; uniform sampler2D specular; uniform sampler2D albedo; uniform sampler2D depth_normal; uniform sampler2D hair;
uniform float exposure;
uniform vec3 backdrop_centre; uniform vec3 backdrop_edge;
uniform float aspect;
out vec4 colour;

// Narkowicz 2016, "ACES filmic tone mapping curve".
vec3 filmic(vec3 x) { return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14); }

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(depth_normal, at, 0).x;
    vec2 d = (uv - vec2(0.5, 0.52)) * vec2(aspect, 1.0);
    vec3 radiance = mix(backdrop_centre, backdrop_edge, smoothstep(0.0, 1.0, length(d)));
    if (depth > 0.0) {
        radiance = texelFetch(albedo, at, 0).rgb * texelFetch(scattered, at, 0).rgb / PI + texelFetch(specular, at, 0).rgb;
    }
    vec4 strands = texelFetch(hair, at, 0);
    radiance = radiance * (1.0 - strands.a) + strands.rgb;
    colour = vec4(clamp(filmic(exposure * radiance), 0.0, 1.0), 1.0);
}
