// Charts carried on beyond their borders, by the nearest texels that are on one.
uniform sampler2D source;
uniform int reach;
out vec4 padded;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy), size = textureSize(source, 0);
    padded = texelFetch(source, here, 0);
    if (padded.a > 0.5) return;
    vec4 sum = vec4(0.0);
    for (int ring = 1; ring <= reach && sum.a == 0.0; ++ring)
        for (int y = -ring; y <= ring; ++y)
            for (int x = -ring; x <= ring; ++x) {
                if (max(abs(x), abs(y)) < ring) continue;
                vec4 e = texelFetch(source, clamp(here + ivec2(x, y), ivec2(0), size - 1), 0);
                if (e.a > 0.5) sum += vec4(e.rgb, 1.0) / float(x * x + y * y);
            }
    padded = sum.a > 0.0 ? vec4(sum.rgb / sum.a, 1.0) : vec4(0.0);
}
