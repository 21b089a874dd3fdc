// What the floor reflects of direct light and of the caustic, by Lambert's law.
#version 460

layout(binding = 0) uniform sampler2D light_map;
layout(binding = 1) uniform sampler2D direct_map;
layout(location = 0) in vec4 uv;
layout(location = 0) out vec4 color;

const vec3 albedo = vec3(0.62, 0.47, 0.33);

void main() {
    vec3 irradiance = texture(light_map, uv.xy).rgb + texture(direct_map, uv.zw).rgb; // W/m^2
    vec3 radiance = irradiance * albedo / 3.14159265;
    const float white = 0.5; // W/m^2/sr
    color = vec4(radiance / (radiance + white), 1.0); // the target is sRGB
}
