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

void main() {
    uint paths = min(totals[6], push.path_capacity);
    uint groups = (paths + SPLAT_GROUP - 1) / SPLAT_GROUP;
    waves[0] = min(groups, MAX_ROW);
    waves[1] = (groups + MAX_ROW - 1) / MAX_ROW;
    waves[2] = 1;
    waves[6] = paths;
    waves[7] = min(waves[7] + totals[7], push.splat_capacity);
    waves[8] += totals[6] - paths;
    waves[9] = 6 * waves[7]; // indices
    waves[10] = 1;           // instances
    waves[11] = 0;
    waves[12] = 0;
    waves[13] = 0;
}
