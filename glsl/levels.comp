// levels: how much resolve has to add, by the levels that footprints went to.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 1) in;
layout(std430, binding = 0) readonly buffer PlanarReceivers { PlanarReceiver planar_receivers[]; };
layout(std430, binding = 1) readonly buffer Coarse { uint coarse[]; }; // by receiver: bit l for footprints in level l
// VkDispatchIndirectCommand by the level that is added to
layout(std430, binding = 2) writeonly buffer Steps { uint steps[]; };
layout(push_constant) uniform LevelsPush {
    uint receiver_count;
    uint rows;           // of a step of resolve, at most
} push;

#include "planar_receiver.glsl"

const uint GROUP = 64; // threads of resolve

void main() {
    uint used = 0;
    uvec2 largest = uvec2(0);
    for (uint i = 0; i < push.receiver_count; i++) {
        used |= coarse[i];
        largest = max(largest, uvec2(planar_receivers[i].width, planar_receivers[i].height));
    }
    for (int level = 0; level < MAX_LEVEL; level++) {
        uvec2 threads = ((largest - 1) >> level) + 3;
        bool needed = used >> (level + 1) != 0;
        steps[3 * level] = needed ? (threads.x + GROUP - 1) / GROUP : 0;
        steps[3 * level + 1] = min(threads.y, push.rows);
        steps[3 * level + 2] = push.receiver_count;
    }
}
