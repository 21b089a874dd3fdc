// plan: the sizes of the dispatches over two work lists.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 1) writeonly buffer Arguments { uint arguments[]; };
layout(push_constant) uniform PlanPush {
    uint per_group;      // items of a workgroup
} push;

#include "dispatch_arguments.glsl"

void main() {
    for (uint i = 0; i < 2; i++) {
        WRITE_DISPATCH(arguments, 3 * i, (counts[i] + push.per_group - 1) / push.per_group)
    }
}
