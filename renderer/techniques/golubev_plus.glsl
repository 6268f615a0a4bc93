// The base samples measure contrast; the rest are taken only where it is high.
#include "shaders/burley_disc.glsl"
uniform float threshold;
uniform float inner_mm;
uniform int base;  // no constant, so that neither loop is unrolled: software drivers run unrolled code for pixels without skin too

void main() {
    Pixel p;
    if (!begin(p)) return;
    Sum sum = Sum(vec3(0.0), vec3(0.0));
    vec4 inner = vec4(0.0), outer = vec4(0.0);
    for (int k = 0; k < base; ++k) {
        vec4 e = take(k, p, sum);
        if (samples[k].z < inner_mm) inner += e; else outer += e;
    }
    vec3 contrast = vec3(0.0);
    if (inner.a > 0.0 && outer.a > 0.0) {
        vec3 l_in = inner.rgb / inner.a, l_out = outer.rgb / outer.a;
        contrast = abs(l_in - l_out) / max(l_in + l_out, 1e-6);
    }
    count.y = max(contrast.r, max(contrast.g, contrast.b));
    int last = any(greaterThanEqual(contrast, vec3(threshold))) ? SAMPLES : base;
    for (int k = base; k < last; ++k) take(k, p, sum);
    count.x = float(last);
    scattered = resolve(p, sum);
}
