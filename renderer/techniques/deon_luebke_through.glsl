// One Gaussian's light from where it enters behind, added up (GPU Gems 3, ch. 14.5.3).
uniform sampler2D place; uniform sampler2D texel_mm;
uniform sampler2D source;    // the light, blurred by this Gaussian
uniform sampler2D thinness;  // exp(-falloff thickness), blurred by the Gaussian before
uniform sampler2D enters;
uniform sampler2D kept;      // what lids, lips and ears leave of it
uniform float sigma; uniform vec3 weight; uniform float falloff;
out vec4 added;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    added = vec4(0.0);
    vec4 entry = texelFetch(enters, here, 0);
    if (texelFetch(place, here, 0).a < 0.5 || entry.z < 0.5) return;
    float t = -log(max(texelFetch(thinness, here, 0).r, 1e-12)) / falloff;
    vec4 e = texture(source, entry.xy);
    if (e.a <= 0.0) return;
    // what enters near by is in the blurred light of this place already
    vec2 texels = entry.xy * vec2(textureSize(place, 0)) - gl_FragCoord.xy;
    float far = clamp(length(texels * texelFetch(texel_mm, here, 0).xy) / (6.0 * sigma), 0.0, 1.0);
    added = vec4(texelFetch(kept, here, 0).r * weight * exp(-t * t / (2.0 * sigma * sigma)) * far * e.rgb / e.a, 0.0);
}
