// nearest: the depth of the triangles at the pixels' centres.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)

#include "camera.glsl"

invariant gl_Position;

void main() {
    gl_Position = seen_at(corner_of(triangle_at(gl_VertexIndex / 3), gl_VertexIndex % 3));
}
