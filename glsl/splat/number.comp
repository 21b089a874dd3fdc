// number: replaces numbers by their prefix sums within blocks of SPLAT_GROUP, and writes the sums of the blocks. One
// thread a block: workgroups that share memory would wait for each other.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) buffer Numbers { uvec2 numbers[]; };
layout(std430, binding = 1) writeonly buffer BlockSums { uvec2 block_sums[]; };
layout(std430, binding = 2) readonly buffer UnitTotals { uint unit_totals[]; }; // as scan.comp writes them
layout(push_constant) uniform NumberPush {
    uint count;
    uint is_limited; // 1: there are at most as many numbers as units in unit_totals
} push;

#include "blocks.glsl"

void main() {
    uint block = thread_index();
    uint count = push.is_limited != 0 ? min(push.count, unit_totals[UNITS_WORD]) : push.count;
    uint end = min((block + 1) * SPLAT_GROUP, count);
    uvec2 sum = uvec2(0);
    for (uint i = block * SPLAT_GROUP; i < end; i++) {
        uvec2 number = numbers[i];
        numbers[i] = sum;
        sum += number;
    }
    if (block * SPLAT_GROUP < count) block_sums[block] = sum;
}
