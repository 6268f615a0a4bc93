// Of the surfaces to which splats may bring light, where they scatter: the normal in view space, and the depth (0: none).
in vec3 world_normal;
uniform mat4 view;
uniform sampler2D depths; uniform sampler2D irradiance;
layout(location = 0) out vec4 seen;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(irradiance, here, 0).a < 0.5 ? 0.0 : texelFetch(depths, here, 0).x;
    seen = vec4(mat3(view) * normalize(world_normal), depth);
}
