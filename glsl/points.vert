// points: one texel each.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(std430, binding = 0) readonly buffer PointSplats { PointSplat splats[]; };
layout(push_constant) uniform DrawPush {
    vec2 atlas_size;  // texels
} push;
layout(location = 0) out flat vec3 irradiance;

void main() {
    PointSplat splat = splats[gl_VertexIndex];
    vec2 texel = vec2(splat.texel & 0xffffu, splat.texel >> 16) + 0.5;
    bool used = splat.texel != NO_TEXEL;
    irradiance = used ? splat.irradiance : vec3(0.0);
    // Unused ones go outside the clip volume.
    gl_Position = used ? vec4(texel / push.atlas_size * 2.0 - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 1.0;
}
