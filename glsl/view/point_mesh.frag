// point mesh: what a diffuse mesh shows of the light at the points of its triangles.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(std430, binding = 4) readonly buffer PointLight { vec4 point_light[]; };
TEXTURE_LEVELS(6)
layout(binding = 7) uniform sampler2D textures;
layout(location = 0) in vec2 weights;
layout(location = 1) in flat uvec4 points;
layout(location = 2) in flat vec3 albedo;
layout(location = 3) in flat uvec2 texture_levels_of;
layout(location = 4) in vec2 uv;
layout(location = 0) out vec4 result;

#include "light_of_points.glsl"
#include "texture.glsl"
#include "textured.glsl"

void main() {
    vec3 sum = light_of_points(TrianglePoints(points.x, points.y, points.z, points.w), weights);
    result = vec4(textured(albedo, texture_levels_of, uv) / PI * sum, 1.0);
}
