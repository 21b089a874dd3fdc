// levels: finds the levels that contain footprints, and writes the dispatch sizes of resolve.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 1) in;
PLANAR_RECEIVERS(0)
layout(std430, binding = 1) readonly buffer Coarse { uint coarse[]; }; // per receiver: bit l is set where footprints are in level l
// One VkDispatchIndirectCommand per level that resolve adds to.
layout(std430, binding = 2) writeonly buffer Steps { uint steps[]; };
layout(push_constant) uniform LevelsPush {
    uint receiver_count;
    uint rows;           // maximum number of coarser rows in one step of resolve, a multiple of RESOLVE_ROWS
} push;


void main() {
    uint used = 0;
    uvec2 largest = uvec2(0);
    for (uint i = 0; i < push.receiver_count; i++) {
        used |= coarse[i];
        largest = max(largest, uvec2(planar_receiver_at(i).width, planar_receiver_at(i).height));
    }
    for (int level = 0; level < MAX_LEVEL; level++) {
        uvec2 coarser = ((largest - 1) >> (level + 1)) + 3;
        bool needed = used >> (level + 1) != 0;
        steps[3 * level] = needed ? (coarser.x + SPLAT_GROUP - 1) / SPLAT_GROUP : 0;
        steps[3 * level + 1] = (min(coarser.y, push.rows) + RESOLVE_ROWS - 1) / RESOLVE_ROWS;
        steps[3 * level + 2] = push.receiver_count;
    }
}
