// rect: what a diffuse rect shows of the light in its maps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(binding = 4) uniform sampler2D light_map;   // caustic irradiance
layout(binding = 5) uniform sampler2D direct_map;  // direct irradiance
TEXTURE_LEVELS(7)
layout(binding = 8) uniform sampler2D textures;
layout(location = 0) in vec4 places;
layout(location = 1) in flat vec4 direct_tile;
layout(location = 2) in flat vec4 light_tile;
layout(location = 3) in flat vec3 albedo;
layout(location = 4) in flat uvec2 texture_levels_of;
layout(location = 5) in vec2 uv;
layout(location = 0) out vec4 result;

#include "look_up.glsl"
#include "texture.glsl"
#include "textured.glsl"

void main() {
    vec3 sum = look_up(direct_map, direct_tile.xy, direct_tile.zw, places.xy);
    vec3 caustic = look_up_smooth(light_map, light_tile.xy, light_tile.zw, places.zw);
    if (light_tile.z > 0.0) sum += caustic;
    result = vec4(textured(albedo, texture_levels_of, uv) / PI * sum, 1.0);
}
