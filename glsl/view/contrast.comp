// contrast: pixels in mirrors and interfaces that differ from a neighbour there are listed for all samples. The detail of textures does
// not count, because rays filter it.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 1) buffer Counts { uint counts[]; };
layout(std430, binding = 2) buffer Pixels { uint pixels[]; };

#include "view_ray.glsl"
UNTEXTURED(0, readonly)
#include "work_list.glsl"

// Ratio of neighbours' luminances that shows an edge.
const float EDGE = 1.15;

const ivec2 NEIGHBOURS[4] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

void main() {
    uint item = push.first.x + group_index() * SPLAT_GROUP + gl_LocalInvocationIndex;
    if (item >= counts[0]) return;
    ivec2 pixel = ivec2(pixels[item] & 0xffffu, pixels[item] >> 16);
    float least = untextured[index_in_tile(pixel)];
    float most = least;
    for (int i = 0; i < 4; i++) {
        float other = untextured[index_in_tile(clamp(pixel + NEIGHBOURS[i], ivec2(push.tile), ivec2(push.end) - 1))];
        if (other == ELSEWHERE) continue;
        least = min(least, other);
        most = max(most, other);
    }
    if (most > EDGE * least) pixels[push.capacity - 1 - atomicAdd(counts[1], 1)] = pixels[item];
}
