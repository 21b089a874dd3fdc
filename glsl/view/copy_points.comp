// copy points: the light of points that are in one place with others whose light is computed.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) readonly buffer CopiedPoints { uvec2 copied_points[]; };
layout(std430, binding = 1) buffer PointLight { vec4 point_light[]; };
layout(push_constant) uniform CopyPush {
    uint first;          // first one of this range of `copied_points`
    uint end;            // of the range
} push;

void main() {
    uint item = push.first + gl_GlobalInvocationID.x;
    if (item >= push.end) return;
    point_light[copied_points[item].x] = point_light[copied_points[item].y];
}
