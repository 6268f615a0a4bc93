// A tap of a filter over the atlas: what lies off the chart is not taken where seams stop.
uniform sampler2D source; uniform sampler2D place; uniform sampler2D texel_mm;
uniform float even_mm;  // mm that every texel is taken to reach; 0: as far as it does
uniform int stop;  // 1: a tap that leaves its chart is the middle's own, 0: whatever lies there

struct Texel { vec4 own; vec3 at; vec2 mm; vec2 uv; };

bool begin(out Texel t) {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 p = texelFetch(place, here, 0);
    t = Texel(texelFetch(source, here, 0), p.xyz, even_mm > 0.0 ? vec2(even_mm) : texelFetch(texel_mm, here, 0).xy, gl_FragCoord.xy / vec2(textureSize(place, 0)));
    return p.a > 0.5;
}

// The light at an offset in texels that should lie `away` mm from here.
vec3 tap(Texel t, vec2 texels, float away) {
    vec2 there = t.uv + texels / vec2(textureSize(place, 0));
    if (stop == 0) return texture(source, there).rgb;
    ivec2 at = ivec2(floor(there * vec2(textureSize(place, 0))));
    if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, textureSize(place, 0)))) return t.own.rgb;
    vec4 p = texelFetch(place, at, 0);
    if (p.a < 0.5 || distance(p.xyz, t.at) > 2.0 * away + 3.0 * max(t.mm.x, t.mm.y)) return t.own.rgb;
    vec4 e = texture(source, there);  // between texels: what is off the chart has no alpha
    return e.a > 0.0 ? e.rgb / e.a : t.own.rgb;
}
