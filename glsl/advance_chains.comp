// advance chains: the sizes of the next wave, and of the draw of the footprints so far.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer Totals { uint totals[]; };   // as scan.comp writes them
// A VkDispatchIndirectCommand with a thread for each path of the wave, three unused words, the number of paths of the wave, the
// number of footprints of earlier waves, that of paths for which there was no room, and a VkDrawIndexedIndirectCommand.
layout(std430, binding = 1) buffer Waves { uint waves[]; };
#include "chain_push.glsl"
#include "dispatch_arguments.glsl"

void main() {
    uint paths = min(totals[6], push.path_capacity);
    WRITE_DISPATCH_OF(waves, 0, paths)
    waves[6] = paths;
    waves[7] = min(waves[7] + totals[7], push.splat_capacity);
    waves[8] += totals[6] - paths;
    WRITE_DRAW(waves, 9, waves[7])
}
