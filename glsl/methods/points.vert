// points: places each point on its texel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"

layout(std430, binding = 0) readonly buffer PointSplats { PointSplat splats[]; };
layout(location = 0) out flat vec3 irradiance;

void main() {
    PointSplat splat = splats[gl_VertexIndex];
    vec2 texel = vec2(splat.texel & 0xffffu, splat.texel >> 16) + 0.5;
    bool used = splat.texel != NO_TEXEL;
    irradiance = used ? splat.irradiance : vec3(0.0);
    // Unused points are placed outside the clip volume.
    gl_Position = used ? clip_position(texel) : vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 1.0;
}
