// visible: the triangles of the scene as the camera sees them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)
OBJECTS(1)
layout(location = 0) out flat uint number;

#include "camera.glsl"

invariant gl_Position;

void main() {
    uint index = gl_VertexIndex / 3;
    Triangle triangle = triangle_at(index);
    // The two triangles of a rect are one surface.
    number = min(index, triangle.twin) | (object_at(triangle.object).kind == DIFFUSE ? 0 : BY_RAYS);
    gl_Position = seen_at(corner_of(triangle, gl_VertexIndex % 3));
}
