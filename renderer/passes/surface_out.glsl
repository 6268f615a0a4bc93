// What the shading of any surface hands to the rest of the frame.
layout(location = 0) out vec4 out_irradiance;    // rgb: E, alpha: 1 where the material scatters
layout(location = 1) out vec4 out_specular;      // rgb: radiance added after scattering
layout(location = 2) out vec4 out_albedo;        // rgb: diffuse albedo
layout(location = 3) out vec4 out_depth_normal;  // x: view depth in mm, yzw: normal in view space
layout(location = 4) out vec4 out_transmitted;   // rgb: irradiance that comes through from behind
in vec3 world; in vec3 world_normal; in vec2 uv; in vec4 a; in vec4 b; in mat3 light; in float open_sky; in float scatters;
in float view_depth;
uniform mat4 view;
