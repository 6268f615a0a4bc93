// What of a lamp's light reaches points of strands: optical depth of the strands before them, and the share that surfaces let past.
#include "shaders/common.glsl"
#include "shaders/lighting.glsl"
uniform sampler2D places;    // xyz: mm in the world
uniform sampler2D tangents;  // w: number of the strand
uniform sampler2D normals;   // xyz: of the skin at the root, w: how near the root is, (0, 1]
uniform int lamp;
layout(location = 0) out vec2 lit;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec3 place = texelFetch(places, at, 0).xyz;
    vec4 root = texelFetch(normals, at, 0);
    // one a strand: what differs from point to point would be dashes along it
    float phase = 2.0 * PI * unit(hash3(ivec3(int(texelFetch(tangents, at, 0).w + 0.5), 3, 7)));
    float facing = dot(root.xyz, lamp_towards(lamp, place));
    float past = surfaces_let_past(lamp, place + root.xyz * 0.8 * root.w, root.xyz * root.w, phase);
    // near its root a strand stands in the shadow of what it stands on
    past *= mix(1.0, smoothstep(-0.35, 0.25, facing), root.w);
    lit = vec2(strands_before(lamp, place, -0.12, 0.12, phase), past);
}
