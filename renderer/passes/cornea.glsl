// The cornea: a sphere of its own radius that meets the ball at the limbus (renderer/scene/cornea.py). Lengths in mm of the ball's frame,
// whose z is the gaze.
const float CORNEA_RADIUS = 7.8;   // Gullstrand's schematic eye
const float AQUEOUS = 1.336;       // index of cornea and aqueous humour as one
const float CRESCENT = 0.8;        // slope of the light across the iris, for a lamp at its horizon
uniform float radius; uniform float iris_radius;

// z of the middle of the cornea's sphere, of the plane of the limbus, and of the iris: its root lies a little behind the limbus, the pupil's
// margin as far behind the apex as the anterior chamber is deep, 3.4 mm.
float cap_z() { return sqrt(radius * radius - iris_radius * iris_radius) - sqrt(CORNEA_RADIUS * CORNEA_RADIUS - iris_radius * iris_radius); }
float iris_z(float rim) {
    float root = sqrt(radius * radius - iris_radius * iris_radius) - 0.35, pupil = cap_z() + CORNEA_RADIUS - 3.4 - 0.25;
    return mix(pupil, root, smoothstep(0.0, 1.0, rim / iris_radius));
}
// Where a ray from p (on the cornea, outside) in direction d meets the iris behind the cornea; Snell's law at the front face.
vec3 to_iris(vec3 p, vec3 n, vec3 d) {
    vec3 inside = refract(d, n, 1.0 / AQUEOUS);
    float z = iris_z(0.5 * iris_radius);
    vec3 q = p;
    for (int k = 0; k < 3; ++k) {  // the iris is nearly flat: its height at the last place
        q = p + inside * max((z - p.z) / min(inside.z, -0.12), 0.0);
        z = iris_z(length(q.xy));
    }
    return q;
}
// Where light that falls along -l on the cornea and ends at q on the iris came in: the share that comes in, over what falls on a surface
// that faces the lamp. The cap narrows a beam to 0.8 of its area at the iris; beyond the limbus the sclera shades.
float through_cornea(vec3 q, vec3 l) {
    vec3 axis = vec3(0.0, 0.0, 1.0), inner = -refract(-l, axis, 1.0 / AQUEOUS);
    if (l.z <= 0.02) return 0.0;
    vec3 from = q - vec3(0.0, 0.0, cap_z());
    float b = dot(from, inner), c = dot(from, from) - CORNEA_RADIUS * CORNEA_RADIUS;
    vec3 entry = from + inner * (-b + sqrt(max(b * b - c, 0.0)));
    vec3 n = entry / CORNEA_RADIUS;
    float cosine = dot(n, l);
    float open = 1.0 - smoothstep(iris_radius - 0.9, iris_radius + 0.3, length(entry.xy));
    // rays converge: more of them end on the side away from the lamp (fitted to rays traced in tests/renderer/test_eyes.py)
    float away = max(1.0 - CRESCENT * dot(q.xy, l.xy) / iris_radius, 0.0);
    return 1.26 * open * smoothstep(0.0, 0.25, cosine) * inner.z * away * (1.0 - 0.02 - 0.98 * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0));
}
