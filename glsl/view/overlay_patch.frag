// overlay patch: the outline of a triangle.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(location = 0) in vec3 inside;
layout(location = 1) in flat vec4 color;
layout(location = 0) out vec4 result;

#include "overlay.glsl"
#include "outline.glsl"

void main() {
    result = vec4(push.white * color.rgb, color.a * outline_of(inside));
}
