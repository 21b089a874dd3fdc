// point mesh: diffuse meshes whose light is at points of their triangles.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)
OBJECTS(1)
layout(std430, binding = 2) readonly buffer TrianglePointsBuffer { TrianglePoints triangle_points[]; };
layout(std430, binding = 3) readonly buffer DrawnTriangles { uint drawn_triangles[]; };
TEXTURED_TRIANGLES(5)
layout(location = 0) out vec2 weights;
layout(location = 1) out flat uvec4 points;
layout(location = 2) out flat vec3 albedo;
layout(location = 3) out flat uvec2 texture_levels_of; // first and number
layout(location = 4) out vec2 uv;                // of the texture

#include "camera.glsl"
#include "texture_corner.glsl"

invariant gl_Position;

void main() {
    uint index = drawn_triangles[push.first + gl_VertexIndex / 3];
    Triangle triangle = triangle_at(index);
    uint corner = gl_VertexIndex % 3;
    albedo = object_at(triangle.object).color;
    uv = texture_corner(index, corner, texture_levels_of);
    TrianglePoints own = triangle_points[index];
    points = uvec4(own.first, own.second, own.third, own.division);
    weights = vec2(corner == 1, corner == 2);
    gl_Position = seen_at(corner_of(triangle, corner));
}
