// contrast: pixels in mirrors and interfaces that differ from a neighbour are listed for all samples.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(binding = 0) uniform sampler2D view;
layout(std430, binding = 1) buffer Counts { uint counts[]; };
layout(std430, binding = 2) buffer Pixels { uint pixels[]; };

#include "view_ray.glsl"
#include "work_list.glsl"

// Ratio of neighbours' radiances that shows an edge.
const float EDGE = 1.15;

const ivec2 NEIGHBOURS[4] = ivec2[](ivec2(-1, 0), ivec2(1, 0), ivec2(0, -1), ivec2(0, 1));

vec3 radiance_at(ivec2 pixel) {
    return texelFetch(view, clamp(pixel, ivec2(push.tile), ivec2(push.end) - 1), 0).rgb;
}

void main() {
    uint item = push.first.x + group_index() * SPLAT_GROUP + gl_LocalInvocationIndex;
    if (item >= counts[0]) return;
    ivec2 pixel = ivec2(pixels[item] & 0xffffu, pixels[item] >> 16);
    vec3 least = radiance_at(pixel);
    vec3 most = least;
    for (int i = 0; i < 4; i++) {
        vec3 other = radiance_at(pixel + NEIGHBOURS[i]);
        least = min(least, other);
        most = max(most, other);
    }
    if (any(greaterThan(most, EDGE * least))) pixels[push.capacity - 1 - atomicAdd(counts[1], 1)] = pixels[item];
}
