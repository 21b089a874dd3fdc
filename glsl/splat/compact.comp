// compact: lists the quads of the slots that a projector filled, in the order of the pairs, and writes the arguments of
// the draw.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 1) readonly buffer GroupCounts { uvec2 group_counts[]; }; // splats, lit pairs
layout(std430, binding = 2) writeonly buffer Quads { uint quads[]; }; // index buffer of the draw
// VkDrawIndexedIndirectCommand, then the numbers of splats and of lit pairs in all batches of the frame.
layout(std430, binding = 3) buffer Arguments { uint arguments[7]; };
layout(push_constant) uniform CompactPush {
    uint pair_count;
    uint slots;          // slots per pair
} push;

#include "prefix_sum.glsl"
#include "dispatch_arguments.glsl"

void main() {
    // Sums over the pairs of the preceding groups. The projector counted the pairs in groups of 64.
    uvec2 part = uvec2(0);
    for (uint group = gl_LocalInvocationIndex; group < gl_WorkGroupID.x * PAIRS_PER_THREAD; group += SPLAT_GROUP) part += group_counts[group];
    uvec2 before, here;
    exclusive_sum(part, before);

    uint first = gl_GlobalInvocationID.x * PAIRS_PER_THREAD;
    uint end = min(first + PAIRS_PER_THREAD, push.pair_count);
    uvec2 own = uvec2(0);
    for (uint pair = first; pair < end; pair++) own += uvec2(counts[pair], min(counts[pair], 1));
    uint rank = before.x + exclusive_sum(own, here).x;
    for (uint pair = first; pair < end; pair++) {
        uint count = counts[pair]; // not in the condition: the validation layer breaks there
        for (uint i = 0; i < count; i++) {
            uint vertex = 4 * (pair * push.slots + i);
            for (uint j = 0; j < 6; j++) quads[6 * rank + j] = vertex + QUAD_CORNERS[j];
            rank++;
        }
    }

    if (gl_WorkGroupID.x == gl_NumWorkGroups.x - 1 && gl_LocalInvocationIndex == 0) {
        uvec2 total = before + here;
        WRITE_DRAW(arguments, 0, total.x)
        arguments[5] += total.x;
        arguments[6] += total.y;
    }
}
