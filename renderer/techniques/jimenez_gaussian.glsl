// One axis of one Gaussian.
#include "shaders/screen.glsl"
uniform sampler2D source; uniform sampler2D irradiance; uniform sampler2D depths;
uniform float taps[7];
uniform float sigma;          // mm, incremental
uniform float alpha;          // pixels per mm of sigma at 1 m
uniform float focal;          // output pixels at unit distance
uniform int published;        // 1: the stretch of the paper's eq. 3, 0: the surface's foreshortening
uniform float beta; uniform float gradient_limit; uniform float supersample;
uniform int reach;  // 3 taps each way; no constant: an unrolled loop would run for pixels without skin too
#if FOLLOW
uniform float follow;         // 1/mm: a tap that lies this far off the pixel's plane is the pixel's own light
#endif
uniform vec2 axis;
out vec4 blurred;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 centre = texelFetch(source, at, 0);
    float depth = texelFetch(depths, at, 0).x / 1000.0;
    vec2 derivative = vec2(dFdx(depth), dFdy(depth)) * supersample;  // metres per output pixel
    blurred = vec4(centre.rgb, 0.0);
    if (texelFetch(irradiance, at, 0).a < 0.5) return;
    float slope = abs(dot(derivative, axis)), tangent = slope * focal / depth;
    float near = published == 1 ? 1.0 / (depth + beta * min(slope, gradient_limit)) : inversesqrt(1.0 + tangent * tangent) / depth;
    vec2 stride = axis * sigma * alpha * near / image_size;
    vec2 uv = image_pixel() / image_size;
    vec3 sum = taps[reach] * centre.rgb;
#if FOLLOW
    float metres = dot(derivative, axis) / supersample * dot(stride, axis * image_size);  // of the plane, a tap
#endif
    for (int n = 0; n < 2 * reach; ++n) {
        int k = n < reach ? n - reach : n - reach + 1;
        vec2 there = uv + float(k) * stride;
        // the stencil of the paper: what is not skin does not bleed in; the centre stands for it
        float own = texel_at(irradiance, there).a > 0.5 ? 0.0 : 1.0;
#if FOLLOW
        own = max(own, clamp(abs(texel_at(depths, there).x - 1000.0 * (depth + float(k) * metres)) * follow, 0.0, 1.0));
#endif
        sum += taps[k + reach] * mix(texel_at(source, there).rgb, centre.rgb, own);
    }
    blurred = vec4(sum, 1.0);
}
