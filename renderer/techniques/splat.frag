// What comes from a point to a pixel: the profile of their distance.
uniform sampler2D depths; uniform sampler2D irradiance; uniform sampler2D profile;
uniform mat4 projection;
uniform float reach_mm;
uniform float area;  // mm2 that a point stands for
flat in vec3 own_light; flat in vec3 own_at;
layout(location = 0) out vec4 sent;
layout(location = 1) out vec4 arrived;

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    if (texelFetch(irradiance, here, 0).a < 0.5) discard;
    float depth = texelFetch(depths, here, 0).x;
    vec2 ndc = gl_FragCoord.xy / vec2(textureSize(depths, 0)) * 2.0 - 1.0;
    vec3 at = vec3(ndc / vec2(projection[0][0], projection[1][1]) * depth, -depth);
    float r = distance(at, own_at);
    if (r >= reach_mm) discard;
    vec3 share = area * texture(profile, vec2(sqrt(r / reach_mm), 0.5)).rgb;
    sent = vec4(own_light * share, 1.0);
    arrived = vec4(share, 1.0);
}
