// list blocks: blocks that some light lights in part. Dark blocks beside others are among them: rays may have missed a bright
// line that reaches the neighbour.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
SURFACES(0)
layout(std430, binding = 1) readonly buffer BlockSurfaces { uint block_surfaces[]; };
layout(std430, binding = 2) readonly buffer Blocks { uint blocks[]; };
layout(std430, binding = 3) buffer Counts { uint counts[]; };
layout(std430, binding = 4) writeonly buffer Items { uvec2 items[]; };
layout(push_constant) uniform ClassifyPush {
    uint first;          // first block
    uint block_count;    // number of all blocks
    uint light_count;
} push;

#include "surface.glsl"
#include "blocks_of_light.glsl"

void main() {
    uint index = push.first + gl_GlobalInvocationID.x;
    if (index >= push.block_count) return;
    DiffuseSurface surface = surface_at(block_surfaces[index]);
    ivec2 block = ivec2(place_of_block(surface, index));
    ivec2 size = ivec2(block_counts(surface));
    bool is_mixed = false;
    for (uint i = 0; i < push.light_count && !is_mixed; i++) {
        uint shade = shade_of(index, i, push.light_count);
        is_mixed = shade == IS_MIXED;
        for (int k = 0; k < 9 && shade == IS_DARK && !is_mixed; k++) {
            ivec2 at = clamp(block + ivec2(k % 3 - 1, k / 3 - 1), ivec2(0), size - 1);
            is_mixed = shade_of(surface.first_block + uint(at.y * size.x + at.x), i, push.light_count) != IS_DARK;
        }
    }
    if (is_mixed) items[atomicAdd(counts[0], 1)] = uvec2(index, 0);
}
