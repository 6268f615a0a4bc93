// What comes from a point to a pixel: on the face where light entered and on the opposite one, mixed by the angle
// between the normals (Donner and Jensen 2005; Rohat 2012, sec. 5.1.2): (1 + n . n') / 2 of the one, the rest of the other.
uniform sampler2D seen;  // normal in view space and depth, splat_seen.frag: one look for each of some hundred splats a pixel
uniform sampler2D near_table; uniform sampler2D far_table;
uniform mat4 projection;
uniform float reach_mm;
uniform float mixed;  // 0: a dipole knows one face, and the opposite one is where normals are opposed
flat in vec3 own_light; flat in vec3 own_at; flat in vec3 own_normal; flat in vec4 own_about; flat in vec3 own_total;
layout(location = 0) out vec4 near;
layout(location = 1) out vec4 arrived;
layout(location = 2) out vec4 far;

vec3 table(sampler2D values, float r) {
    return r < reach_mm ? texture(values, vec2(sqrt(r / reach_mm), own_about.z)).rgb : vec3(0.0);
}

void main() {
    vec4 to = texelFetch(seen, ivec2(gl_FragCoord.xy), 0);
    float depth = to.a;
    if (depth <= 0.0) discard;
    vec2 ndc = gl_FragCoord.xy / vec2(textureSize(seen, 0)) * 2.0 - 1.0;
    vec3 away = vec3(ndc / vec2(projection[0][0], projection[1][1]) * depth, -depth) - own_at;
    float r = length(away);
    // of the way through the object only what leads along its faces counts
    float through = clamp(-dot(away, own_normal), 0.0, own_about.y);
    float along = sqrt(max(r * r - through * through, 0.0));
    float cosine = dot(to.xyz, own_normal);
    float same = mixed > 0.5 ? 0.5 + 0.5 * cosine : smoothstep(-0.5, 0.0, cosine);
    vec3 one = own_about.x * same * table(near_table, r);
    vec3 other = own_about.x * (1.0 - same) * table(far_table, along);
    if (one + other == vec3(0.0)) discard;
    near = vec4(own_light * own_total * one, 1.0);
    arrived = vec4(one, 1.0);
    far = vec4(own_light * other, 1.0);
}
