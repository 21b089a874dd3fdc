// compact: lists the slots that project filled, in their order, and writes the draw's arguments.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout.glsl"

const uint GROUP = 64;
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 1) readonly buffer GroupCounts { uint group_counts[]; };
layout(std430, binding = 2) writeonly buffer Order { uint order[]; };
// VkDrawIndirectCommand, then the number of footprints
layout(std430, binding = 3) writeonly buffer Arguments { uint arguments[5]; };
layout(push_constant) uniform CompactPush {
    uint pair_count;
    uint receiver_count;
} push;

shared uint sums[GROUP];

// Sum of all threads' values before this one's (Hillis & Steele 1986); all in `total`.
uint exclusive_sum(uint value, out uint total) {
    uint i = gl_LocalInvocationIndex;
    sums[i] = value;
    barrier();
    for (uint stride = 1; stride < GROUP; stride *= 2) {
        uint before = i >= stride ? sums[i - stride] : 0;
        barrier();
        sums[i] += before;
        barrier();
    }
    total = sums[GROUP - 1];
    uint result = sums[i] - value;
    barrier();
    return result;
}

void main() {
    // Footprints of the groups before this one.
    uint part = 0;
    for (uint group = gl_LocalInvocationIndex; group < gl_WorkGroupID.x; group += GROUP) part += group_counts[group];
    uint before, here;
    exclusive_sum(part, before);

    uint local = gl_GlobalInvocationID.x;
    uint count = local < push.pair_count ? counts[local] : 0;
    uint rank = exclusive_sum(count, here);
    for (uint i = 0; i < count; i++) order[before + rank + i] = local * push.receiver_count + i;

    if (gl_WorkGroupID.x == gl_NumWorkGroups.x - 1 && gl_LocalInvocationIndex == 0) {
        arguments[0] = 6 * (before + here); // vertices
        arguments[1] = 1;                   // instances
        arguments[2] = 0;
        arguments[3] = 0;
        arguments[4] = before + here;
    }
}
