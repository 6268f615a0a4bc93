// Where texels lie, and how many mm one reaches along u and v (the inverse of a stretch map: 1 / |dP/du|, |dP/dv|).
uniform sampler2D light; uniform sampler2D at; uniform sampler2D facing;
layout(location = 0) out vec4 place;
layout(location = 1) out vec4 texel_mm;
layout(location = 2) out vec4 normal;

// Of two neighbours those that are on the surface count; a step across a seam is the longer one.
float reach(ivec2 here, ivec2 axis, vec4 p) {
    float least = 1e9;
    for (int side = -1; side <= 1; side += 2) {
        ivec2 there = here + side * axis;
        if (any(lessThan(there, ivec2(0))) || any(greaterThanEqual(there, textureSize(at, 0)))) continue;
        vec4 q = texelFetch(at, there, 0);
        if (q.a > 0.5) least = min(least, distance(p.xyz, q.xyz));
    }
    return least < 1e9 ? max(least, 1e-4) : 1.0;
}

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 p = texelFetch(at, here, 0);
    float on = texelFetch(light, here, 0).a > 0.5 && p.a > 0.5 ? 1.0 : 0.0;
    place = vec4(p.xyz, on);
    normal = vec4(on > 0.0 ? normalize(texelFetch(facing, here, 0).xyz) : vec3(0.0), on);
    texel_mm = on > 0.0 ? vec4(reach(here, ivec2(1, 0), p), reach(here, ivec2(0, 1), p), 0.0, 1.0) : vec4(1.0);
}
