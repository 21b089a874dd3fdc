// What the floor reflects of direct light and of the caustic, by Lambert's law.
#version 460

layout(binding = 0) uniform sampler2D light_map;
layout(binding = 1) uniform sampler2D direct_map;
layout(location = 0) in vec2 uv;
layout(location = 1) in flat vec3 albedo;
layout(location = 0) out vec4 color;

void main() {
    vec3 irradiance = texture(light_map, uv).rgb + texture(direct_map, uv).rgb; // W/m^2
    vec3 radiance = irradiance * albedo / 3.14159265;
    const float white = 0.5; // W/m^2/sr
    color = vec4(radiance / (radiance + white), 1.0); // the target is sRGB
}
