// Scattered irradiance to radiance, specular on top, hair over it, a studio backdrop behind; tone mapped, still linear.
#include "shaders/common.glsl"
in vec2 uv;
uniform sampler2D scattered; uniform sampler2D specular; uniform sampler2D albedo; uniform sampler2D depth_normal; uniform sampler2D hair;
uniform float exposure;
uniform vec3 backdrop_centre; uniform vec3 backdrop_edge;
uniform float aspect;
out vec4 colour;

// John Hable's curve ("Filmic tonemapping operators", 2010), white at 11.2.
vec3 hable(vec3 x) { return (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.50) + 0.06) - 0.02 / 0.30; }

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
    colour = vec4(clamp(hable(2.0 * exposure * radiance) / hable(vec3(11.2)), 0.0, 1.0), 1.0);
}
