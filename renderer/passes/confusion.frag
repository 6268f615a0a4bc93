// The radius in output pixels over which a thin lens spreads a pixel (x, negative before the focus), and its depth (y, mm; 0: behind all).
#include "shaders/common.glsl"
uniform sampler2D depths; uniform sampler2D specular;  // its alpha: what hair hides
uniform int factor;
uniform float spread;    // px: of a point infinitely far behind the focus
uniform float focus_mm; uniform float subject_mm;
uniform float largest;   // px
out vec4 confusion;

// The depth that an output pixel shows: that of the nearest of its samples.
vec2 shown(ivec2 pixel) {
    float nearest = 0.0, hair = 0.0;
    for (int y = 0; y < factor; ++y) for (int x = 0; x < factor; ++x) {
        ivec2 at = clamp(pixel * factor + ivec2(x, y), ivec2(0), textureSize(depths, 0) - 1);
        float d = texelFetch(depths, at, 0).x;
        if (d > 0.0) nearest = nearest > 0.0 ? min(nearest, d) : d;
        hair = max(hair, texelFetch(specular, at, 0).a);
    }
    return vec2(nearest, hair);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 here = shown(pixel);
    if (here.x == 0.0 && here.y > 0.05) {  // hair before nothing stands where the head beside it does, or as far as the subject
        float sum = 0.0, count = 0.0, phase = 2.0 * PI * interleaved_gradient_noise(gl_FragCoord.xy);
        float reach = 0.06 * float(textureSize(depths, 0).y / factor);
        for (int k = 0; k < 16; ++k) {
            float d = shown(pixel + ivec2(reach * vogel(k, 16, phase))).x;
            if (d > 0.0) { sum += d; count += 1.0; }
        }
        here.x = count > 0.0 ? sum / count : subject_mm;
    }
    float radius = here.x > 0.0 ? spread * (1.0 - focus_mm / here.x) : spread;
    confusion = vec4(clamp(radius, -largest, largest), here.x, 0.0, 1.0);
}
