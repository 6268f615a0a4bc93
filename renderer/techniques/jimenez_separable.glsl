// One of the two passes of the separable kernel.
#include "shaders/rotation.glsl"
uniform sampler2D source; uniform sampler2D irradiance; uniform sampler2D depths;
uniform vec4 kernel[TAPS];       // rgb weight, offset in mm
uniform int taps;                // no constant: an unrolled loop would run for pixels without skin too
uniform vec2 axis;
uniform float pixels_per_mm;     // at 1 mm
uniform float follow_surface_mm;
uniform float near_mm;
uniform int plane;               // 1: taps follow the surface's own plane, 0: its depth alone
layout(location = 0) out vec4 scattered;
layout(location = 1) out vec4 count;

void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    vec4 centre = texelFetch(source, at, 0);
    scattered = centre;
    count = vec4(0.0, 0.0, 0.0, 1.0);
    float depth = texelFetch(depths, at, 0).x;
    vec2 slope = plane == 1 ? vec2(dFdx(depth), dFdy(depth)) : vec2(0.0);  // mm of depth a pixel
    if (texelFetch(irradiance, at, 0).a < 0.5) return;
    vec2 uv = image_pixel() / image_size;
    float scale = pixels_per_mm / depth;
    mat2 rotated = rotation();
    vec3 sum = vec3(0.0);
    for (int k = 0; k < taps; ++k) {
        float offset = kernel[k].w;
        vec2 direction = abs(offset) < near_mm ? rotated * axis : axis;
        float tangent = dot(slope, direction) * scale;
        vec2 apart = direction * offset * scale * inversesqrt(1.0 + tangent * tangent);
        vec2 there = uv + apart / image_size;
        vec3 tap = texel_at(source, there).rgb;
        float away = abs(texel_at(depths, there).x - depth - dot(slope, apart)) / follow_surface_mm;
        if (texel_at(irradiance, there).a < 0.5) away = 1.0;
        sum += kernel[k].rgb * mix(tap, centre.rgb, clamp(away, 0.0, 1.0));
    }
    scattered = vec4(sum, 1.0);
    count.x = float(2 * taps);
}
