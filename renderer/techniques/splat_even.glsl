// Irradiance from nine harmonics by the normal (Ramamoorthi and Hanrahan 2001; renderer/scene/harmonics.py), added.
uniform sampler2D irradiance; uniform sampler2D normals;
uniform vec3 coefficients[9];  // times what a clamped cosine keeps of each degree
layout(location = 0) out vec4 total;
void main() {
    ivec2 here = ivec2(gl_FragCoord.xy);
    vec4 e = texelFetch(irradiance, here, 0);
    vec3 n = texelFetch(normals, here, 0).xyz;
    n /= max(length(n), 1e-6);
    vec3 even = 0.282094792 * coefficients[0]
        + 0.488602512 * (coefficients[1] * n.y + coefficients[2] * n.z + coefficients[3] * n.x)
        + 1.092548431 * (coefficients[4] * n.x * n.y + coefficients[5] * n.y * n.z + coefficients[7] * n.x * n.z)
        + 0.315391565 * coefficients[6] * (3.0 * n.z * n.z - 1.0)
        + 0.546274215 * coefficients[8] * (n.x * n.x - n.y * n.y);
    total = vec4(e.rgb + max(even, 0.0), e.a);
}
