// mesh: what a diffuse mesh with a light map shows of the light in its maps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(binding = 6) uniform sampler2D light_map;   // caustic irradiance
layout(binding = 7) uniform sampler2D direct_map;  // direct irradiance
TEXTURE_LEVELS(9)
layout(binding = 10) uniform sampler2D textures;
layout(location = 0) in vec2 place;
layout(location = 1) in flat vec4 tiles;
layout(location = 2) in flat vec2 size;
layout(location = 3) in flat vec3 albedo;
layout(location = 4) in flat uvec2 texture_levels_of;
layout(location = 5) in vec2 uv;
layout(location = 0) out vec4 result;

#include "look_up.glsl"
#include "texture.glsl"
#include "textured.glsl"

void main() {
    vec3 sum = look_up(direct_map, tiles.xy, size, tiles.xy + place) + look_up(light_map, tiles.zw, size, tiles.zw + place);
    result = vec4(textured(albedo, texture_levels_of, uv) / PI * sum, 1.0);
}
