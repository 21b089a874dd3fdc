// overlay even patch: patches of even size, and patch clusters as the triangles that stand for them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(std430, binding = 0) readonly buffer PatchBuffer { Patch patches[]; };
layout(location = 0) out vec3 inside;       // barycentric coordinates
layout(location = 1) out flat vec4 color;

#include "overlay.glsl"

void main() {
    Patch patch_ = patches[gl_VertexIndex / 3];
    uint corner = gl_VertexIndex % 3;
    inside = vec3(corner == 0, corner == 1, corner == 2);
    color = vec4(0.3, 1.0, 0.3, 0.9);
    vec2 st = vec2(corner == 1, corner == 2) - 1.0 / 3.0;
    gl_Position = seen_over(patch_.position + st.x * patch_.edge1 + st.y * patch_.edge2);
}
