// What of a lamp's light reaches points of strands through hair and past surfaces, [0, 1]: once for all views.
#include "shaders/common.glsl"
#include "shaders/lighting.glsl"
uniform sampler2D places;    // xyz: mm in the world, w: cover
uniform sampler2D normals;   // of the skin at the root
uniform int lamp;
uniform float extinction;    // of the whole layer along its normal
layout(location = 0) out vec4 lit;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 place = texelFetch(places, at, 0);
    vec3 root_normal = texelFetch(normals, at, 0).xyz;
    float phase = 2.0 * PI * unit(hash3(ivec3(at, 7)));
    float facing = dot(root_normal, lamp_towards(lamp, place.xyz));
    float path = place.w * extinction / max(facing, 0.22);
    float seen = visibility(lamp, place.xyz + root_normal * 0.8, root_normal, phase);
    lit = vec4(exp(-path) * smoothstep(-0.35, 0.25, facing) * seen);
}
