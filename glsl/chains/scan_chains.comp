// scan chains: replaces the sums of blocks of a wave by their prefix sums, and writes the sizes of the next wave and of the list of
// landings on mesh receivers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) buffer BlockSums { uvec2 block_sums[]; };
// A VkDispatchIndirectCommand with a thread for each path of the wave, the number of landings of earlier waves, two unused words, the
// number of paths of the wave, the number of footprints of earlier waves, and a VkDrawIndexedIndirectCommand of the footprints where
// each path of the wave has one.
layout(std430, binding = 1) readonly buffer Waves { uint waves[]; };
layout(std430, binding = 2) writeonly buffer NextWaves { uint next_waves[]; };
layout(std430, binding = 3) buffer LandingSums { uvec2 landing_sums[]; };
// The landings where each path of the next wave has one: a VkDispatchIndirectCommand with a thread for each and one at least, three
// unused words and their number.
layout(std430, binding = 4) writeonly buffer LandingSizes { uint landing_sizes[]; };
#include "chain_push.glsl"

#include "prefix_sum.glsl"
#include "dispatch_arguments.glsl"

// One workgroup.
void main() {
    uint blocks = (waves[UNITS_WORD] + SPLAT_GROUP - 1) / SPLAT_GROUP;
    SCAN_BLOCKS(block_sums, blocks, total)
    uvec2 landed = uvec2(0);
    if (HAS_ATLAS) {
        SCAN_BLOCKS(landing_sums, blocks, of_wave)
        landed = of_wave;
    }
    if (gl_LocalInvocationIndex != 0) return;
    uint paths = min(total.x, push.path_capacity);
    uint footprints = min(waves[FOOTPRINTS_WORD] + total.y, push.splat_capacity);
    WRITE_DISPATCH_OF(next_waves, 0, paths)
    next_waves[UNITS_WORD] = paths;
    next_waves[FOOTPRINTS_WORD] = footprints;
    if (HAS_ATLAS) {
        uint landings = min(waves[LANDINGS_WORD] + landed.x, push.path_capacity);
        uint with_paths = min(landings + paths, push.path_capacity);
        next_waves[LANDINGS_WORD] = landings;
        WRITE_DISPATCH_OF(landing_sizes, 0, max(with_paths, 1))
        landing_sizes[UNITS_WORD] = with_paths;
    }
    WRITE_DRAW(next_waves, WAVE_DRAW_WORD, min(footprints + paths, push.splat_capacity))
}
