// One axis of one Gaussian; on the vertical axis also the weighted sum so far.
uniform sampler2D source; uniform sampler2D sum_so_far; uniform sampler2D irradiance; uniform sampler2D depth_normal;
uniform float taps[7];
uniform float sigma;          // mm, incremental
uniform float alpha;          // pixels per mm of sigma at 1 m
uniform float focal;          // output pixels at unit distance
uniform int published;        // 1: the stretch of the paper's eq. 3, 0: the surface's foreshortening
uniform float beta; uniform float gradient_limit; uniform float supersample;
uniform int reach;  // 3 taps each way; no constant: an unrolled loop would run for pixels without skin too
uniform vec2 axis; uniform vec3 weight; uniform vec3 sum_scale; uniform float samples; uniform int final;
layout(location = 0) out vec4 blurred;
layout(location = 1) out vec4 total;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 centre = texelFetch(source, at, 0);
    float depth = texelFetch(depth_normal, at, 0).x / 1000.0;
    vec2 derivative = vec2(dFdx(depth), dFdy(depth)) * supersample;  // metres per output pixel
    bool skin = texelFetch(irradiance, at, 0).a > 0.5;
    vec3 sum = centre.rgb;
    if (skin) {
        float slope = abs(dot(derivative, axis)), tangent = slope * focal / depth;
        float near = published == 1 ? 1.0 / (depth + beta * min(slope, gradient_limit)) : inversesqrt(1.0 + tangent * tangent) / depth;
        vec2 stride = axis * sigma * alpha * near / vec2(textureSize(source, 0));
        vec2 uv = gl_FragCoord.xy / vec2(textureSize(source, 0));
        sum = taps[3] * centre.rgb;
        for (int k = -reach; k <= reach; ++k) {
            if (k == 0) continue;
            vec2 there = uv + float(k) * stride;
            // the stencil of the paper: what is not skin does not bleed in; the centre stands for it
            sum += taps[k + 3] * (texture(irradiance, there).a > 0.5 ? texture(source, there).rgb : centre.rgb);
        }
    }
    vec3 added = sum_scale * texelFetch(sum_so_far, at, 0).rgb + weight * sum;
    if (!skin) added = texelFetch(irradiance, at, 0).rgb;
    blurred = vec4(final == 1 ? added : sum, skin ? 1.0 : 0.0);
    total = final == 1 ? vec4(skin ? samples : 0.0, 0.0, 0.0, 1.0) : vec4(added, 1.0);
}
