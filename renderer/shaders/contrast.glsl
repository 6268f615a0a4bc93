// A single-pass filter whose samples are spent by local contrast: Vuletic, master's thesis, ch. 4. Included after what gives
// Pixel, Sum, begin, take, resolve, the samples (radius in z) and count; renderer/techniques/contrast.py gives the rest.
uniform int base;         // samples that are always taken, and measure contrast; no constant, so that no loop is unrolled
uniform int extra;        // samples that are taken beside them where contrast is highest
uniform float inner_mm;   // radius of the inner zone
uniform float threshold;  // half of the extra samples are due at this contrast
uniform float exponent;   // of the contrast
uniform int continuous;   // 1: any number of extra samples, 0: all or none
uniform int own_sets;     // 1: a set of its own for every number of extra samples, one after the other

void main() {
    Pixel p;
    if (!begin(p)) return;
    Sum sum = Sum(vec3(0.0), vec3(0.0));
    vec4 inner = vec4(0.0), outer = vec4(0.0);
    for (int k = 0; k < base; ++k) {
        vec4 e = take(k, p, sum);
        if (samples[k].z < inner_mm) inner += e; else outer += e;
    }
    float contrast = 0.0;
    if (inner.a > 0.0 && outer.a > 0.0) {  // eq. 4.1, the channel where it is highest
        vec3 l_in = inner.rgb / inner.a, l_out = outer.rgb / outer.a;
        vec3 channels = abs(l_in - l_out) / max(l_in + l_out, 1e-6);
        contrast = max(channels.r, max(channels.g, channels.b));
    }
    count.y = contrast;
    // eq. 4.2, round(saturate(C + offset)), is C >= threshold = 0.5 - offset: half-way up the ramp from 0 to 2 threshold
    float remapped = exponent == 1.0 ? contrast : pow(contrast, exponent);
    int more = remapped >= threshold ? extra : 0;
    if (continuous == 1 && threshold > 0.0) more = int(float(extra) * min(0.5 * remapped / threshold, 1.0) + 0.5);
    int first = base + own_sets * (more * (more - 1)) / 2;
    for (int k = first; k < first + more; ++k) take(k, p, sum);
    count.x = float(base + more);
    scattered = resolve(p, sum);
}
