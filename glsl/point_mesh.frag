// point mesh: what a diffuse mesh shows of the light at the points of its triangles.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(std430, binding = 4) readonly buffer PointLight { vec4 point_light[]; };
layout(location = 0) in vec2 weights;
layout(location = 1) in flat uvec4 points;
layout(location = 2) in flat vec3 albedo;
layout(location = 0) out vec4 result;

#include "light_of_points.glsl"

void main() {
    vec3 sum = light_of_points(TrianglePoints(points.x, points.y, points.z, points.w), weights);
    result = vec4(albedo / PI * sum, 1.0);
}
