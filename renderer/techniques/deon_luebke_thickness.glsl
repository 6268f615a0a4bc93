// How thick the surface's body is towards a lamp, over the atlas, and where the light then enters (GPU Gems 3, ch. 14.5.3).
// Of several lamps the depth test keeps the one towards which it is thinnest.
uniform sampler2D place; uniform sampler2D normal;
uniform sampler2D entry; uniform sampler2D entry_normal;
uniform mat4 layer;
uniform vec4 lamp;  // towards a distant lamp (w = 0), or its position in mm (w = 1)
uniform float falloff;  // per mm
uniform float shrink_mm;  // inwards, before a place is looked up: at grazing angles the map is coarse
uniform float lit_mm;   // taken for the thickness where the lamp shines on the surface itself
layout(location = 0) out vec4 thinness;  // rgb: exp(-falloff thickness), alpha 1 on the surface
layout(location = 1) out vec4 enters;    // xy: place in the atlas, z: 1 where there is one
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 p = texelFetch(place, here, 0);
    if (p.a < 0.5) discard;
    vec3 n = texelFetch(normal, here, 0).xyz, l = lamp.w == 0.0 ? lamp.xyz : normalize(lamp.xyz - p.xyz);
    vec4 q = layer * vec4(p.xyz - shrink_mm * n, 1.0);
    vec2 at = q.xy / q.w * 0.5 + 0.5;
    bool inside = q.w > 0.0 && all(greaterThanEqual(at, vec2(0.0))) && all(lessThan(at, vec2(1.0)));
    ivec2 texel = ivec2(at * vec2(textureSize(entry, 0)));
    vec4 e = inside ? texelFetch(entry, texel, 0) : vec4(0.0);  // its place in the atlas; depth between texels is smooth
    vec4 between = texture(entry, at), facing = texture(entry_normal, at);
    float depth = (layer * vec4(p.xyz, 1.0)).z, t = lit_mm;
    if (e.a > 0.5) {
        float along = dot(n, l) > 0.0 ? lit_mm : max(depth - between.z / between.a, 0.0);
        // of a part whose far side faces away from here the thickness counts, not the slanted way
        float across = clamp(-dot(n, l), 0.0, 1.0) * along;
        t = min(mix(along, across, clamp(-dot(normalize(facing.xyz), n), 0.0, 1.0)), lit_mm);
    }
    thinness = vec4(vec3(exp(-falloff * t)), 1.0);
    enters = vec4(e.xy, e.a, 1.0);
    gl_FragDepth = t / (2.0 * lit_mm);
}
