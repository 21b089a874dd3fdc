// scan: replaces the sums of blocks by their prefix sums, and writes the arguments of the passes that follow.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) buffer BlockSums { uvec2 block_sums[]; };
// Two VkDispatchIndirectCommands, of a thread for each unit of either sum, the two totals, and an unused word; then for
// every batch of units of the first sum a VkDispatchIndirectCommand, a VkDrawIndexedIndirectCommand of a quad for each,
// and an unused word.
layout(std430, binding = 1) writeonly buffer Totals { uint totals[]; };
layout(std430, binding = 2) readonly buffer UnitTotals { uint unit_totals[]; }; // as this shader writes them
layout(push_constant) uniform ScanPush {
    uint count;      // of the numbers in the blocks
    uint is_limited; // 1: there are at most as many numbers as units in unit_totals
    uint batches;
    uint batch_size;
} push;

#include "prefix_sum.glsl"
#include "dispatch_arguments.glsl"

// One workgroup.
void main() {
    uint count = push.is_limited != 0 ? min(push.count, unit_totals[UNITS_WORD]) : push.count;
    uint blocks = (count + SPLAT_GROUP - 1) / SPLAT_GROUP;
    SCAN_BLOCKS(block_sums, blocks, total)
    if (gl_LocalInvocationIndex == 0) {
        WRITE_DISPATCH_OF(totals, 0, total.x)
        WRITE_DISPATCH_OF(totals, 3, total.y)
        totals[UNITS_WORD] = total.x;
        totals[SECOND_UNITS_WORD] = total.y;
        for (uint batch = 0; batch < push.batches; batch++) {
            uint first = batch * push.batch_size;
            uint units = min(max(total.x, first) - first, push.batch_size);
            uint at = ARGUMENT_WORDS * (batch + 1);
            WRITE_DISPATCH_OF(totals, at, units)
            WRITE_DRAW(totals, at + BATCH_DRAW_WORD, units)
        }
    }
}
