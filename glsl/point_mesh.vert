// point mesh: diffuse meshes whose light is at points of their triangles.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)
OBJECTS(1)
layout(std430, binding = 2) readonly buffer TrianglePointsBuffer { TrianglePoints triangle_points[]; };
layout(std430, binding = 3) readonly buffer DrawnTriangles { uint drawn_triangles[]; };
layout(location = 0) out vec2 weights;
layout(location = 1) out flat uvec4 points;
layout(location = 2) out flat vec3 albedo;

#include "albedo.glsl"
#include "camera.glsl"

invariant gl_Position;

void main() {
    uint index = drawn_triangles[push.first + gl_VertexIndex / 3];
    Triangle triangle = triangle_at(index);
    uint corner = gl_VertexIndex % 3;
    albedo = albedo_of(object_at(triangle.object));
    TrianglePoints own = triangle_points[index];
    points = uvec4(own.first, own.second, own.third, own.division);
    weights = vec2(corner == 1, corner == 2);
    gl_Position = seen_at(corner_of(triangle, corner));
}
