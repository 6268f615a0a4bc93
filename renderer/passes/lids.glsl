// The edges of the lids before an eye: distances in mm to the upper (x) and to the lower edge (y), above 0 where the ball is seen, below 0
// under that lid; seen from the front, over edges_mm about the ball's centre. own: mm from the centre, in the head's axes.
vec2 to_edges(sampler2D edges, vec2 edges_mm, vec2 own) { return textureLod(edges, own / edges_mm + 0.5, 0.0).rg; }
// Towards where that distance grows, in the plane of the front.
vec2 away_from_edge(sampler2D edges, vec2 edges_mm, vec2 own, int which) {
    vec2 step_mm = vec2(0.25, 0.0);
    vec2 right = to_edges(edges, edges_mm, own + step_mm), left = to_edges(edges, edges_mm, own - step_mm);
    vec2 over = to_edges(edges, edges_mm, own + step_mm.yx), below = to_edges(edges, edges_mm, own - step_mm.yx);
    vec2 d = which == 0 ? vec2(right.x - left.x, over.x - below.x) : vec2(right.y - left.y, over.y - below.y);
    return d / max(length(d), 1e-4);
}

// Skin of lids. x: distance in mm from the edge that lies on the ball, seen from the front; 99 where no lid is near. y: how much of it is the
// upper lid's, half at the corners. local: mm of the object.
uniform int lid_count; uniform vec4 lid_ball[2];  // centre, radius
uniform sampler2D edges_a; uniform sampler2D edges_b;
uniform vec2 edges_mm;
vec2 on_lid(vec3 local) {
    for (int k = 0; k < lid_count; ++k) {
        vec3 own = local - lid_ball[k].xyz;
        float away = length(own) - lid_ball[k].w;
        if (away > 4.5 || own.z < 0.0) continue;
        vec2 edge = k == 0 ? to_edges(edges_a, edges_mm, own.xy) : to_edges(edges_b, edges_mm, own.xy);
        float far = 6.0 * smoothstep(3.0, 4.5, away);  // no border where lids end
        return vec2(far - min(edge.x, edge.y), clamp(0.5 + 0.4 * (edge.y - edge.x), 0.0, 1.0));
    }
    return vec2(99.0, 0.0);
}

// The share of light that comes through skin from behind: a lid holds a plate of dense tissue, the tarsus, 8 to 10 mm high in the upper one.
uniform float tarsus;
float through_lid(vec3 local) { return 1.0 - tarsus * (1.0 - smoothstep(3.0, 6.0, on_lid(local).x)); }
// And through a lip, of whose mask 0.5 is the border and 1 the seam: it is muscle below a thin vermilion.
uniform float lip_muscle;
float through_lip(float mask) { return 1.0 - lip_muscle * smoothstep(0.45, 0.75, mask); }
// And through a nostril's wing, 4 to 6 mm of fat and fibres that stand thinner here, seen from its lining, of which `inside` says how deep it lies.
uniform float nose_wing;
float through_wing(float inside) { return (1.0 - inside) * (1.0 - nose_wing * smoothstep(0.0, 0.05, inside)); }
// And through an ear: all of it but the lobe is a plate of cartilage between two thin skins. local: mm; the ears: their middles.
uniform float cartilage; uniform vec3 ear_l; uniform vec3 ear_r;
float through_ear(vec3 local) {
    vec3 to_l = local - ear_l, to_r = local - ear_r, off = dot(to_l, to_l) < dot(to_r, to_r) ? to_l : to_r;
    return 1.0 - cartilage * (1.0 - smoothstep(40.0, 50.0, length(off))) * smoothstep(-22.0, -12.0, off.y);
}
// All of it: the share of what comes through to a place that is left. lip: the mask; inside: 1 within the mouth and the nostrils.
float through_flesh(vec3 local, float lip, float inside) { return through_wing(inside) * through_lid(local) * through_lip(lip) * through_ear(local); }
