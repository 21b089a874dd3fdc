// list pixels: pixels that show one triangle that reflects or refracts, from the front of the list, and pixels whose samples
// show several triangles, or the edge of a light, from its end. Other pixels stay as they were drawn.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
LIGHTS(0)
layout(binding = 1) uniform usampler2D visible;   // triangles at the samples of this tile of the picture
layout(binding = 4) uniform sampler2D visible_depth; // near / distance
layout(std430, binding = 5) readonly buffer SmoothGroups { uint smooth_groups[]; };
layout(std430, binding = 2) buffer Counts { uint counts[]; };
layout(std430, binding = 3) writeonly buffer Pixels { uint pixels[]; };

layout(constant_id = ID_SHOWS_LIGHTS) const bool SHOWS_LIGHTS = true;
layout(constant_id = ID_ONE_SAMPLE) const bool ONE_SAMPLE = true;

#include "view_ray.glsl"
#include "light.glsl"

// Whether the direction shows a lamp, or the edge of a sun. `pixel` in rad.
bool may_show_light(vec3 direction, float pixel) {
    bool shows = false;
    for (uint i = 0; i < push.light_count; i++) {
        LightDisc disc = disc_at(light_at(i), push.eye);
        float beyond = distance(direction, disc.direction) - 2.0 * sin(0.5 * disc.angular_radius);
        shows = shows || beyond < pixel && (beyond > -pixel || light_at(i).is_lamp != 0);
    }
    return shows;
}

// Triangles of a group join smoothly.
uint group_of(uint number) {
    return number == NO_TRIANGLE ? NO_TRIANGLE : smooth_groups[number & ~BY_RAYS];
}

// Whether samples at the corners of a square show one surface: the reciprocal of the distance is linear on a plane. The
// bound is far above what the curvature of a surface adds within a pixel.
bool is_flat(vec4 depth) {
    return abs(depth.x - depth.y + depth.z - depth.w) <= 2e-4 * (depth.x + depth.z);
}

// Pixels of consecutive threads, and so of the lists, are in blocks of 4 x 2: rays of compact groups meet the same boxes.
uvec2 place_in_group(uint index) {
    return uvec2(index & 3u | index >> 1 & 4u, index >> 2 & 1u | index >> 3 & 6u);
}

void main() {
    uvec2 pixel = push.first + GROUP_SIDE * gl_WorkGroupID.xy + place_in_group(gl_LocalInvocationIndex);
    if (pixel.x >= push.end.x || pixel.y >= push.end.y) return;
    ivec2 corner = ivec2((pixel - push.tile) * push.side);
    int last = int(push.side) - 1;
    uint first = texelFetch(visible, corner, 0).r;
    bool is_even = true;
    if (ONE_SAMPLE) {
        // The pixel shows one triangle.
    } else if (push.side == 2) {
        // The samples of the lower left, lower right, upper right, upper left.
        vec2 place = (vec2(corner) + 1.0) / vec2(textureSize(visible, 0));
        uvec4 all = textureGather(visible, place);
        uint group = group_of(first);
        is_even = group == group_of(all.x) && group == group_of(all.y) && group == group_of(all.z);
        vec4 depth = textureGather(visible_depth, place);
        is_even = is_even && is_flat(depth);
    } else if (push.side > 2) {
        for (int i = 1; i < (last + 1) * (last + 1) && is_even; i++) {
            is_even = group_of(texelFetch(visible, corner + ivec2(i % (last + 1), i / (last + 1)), 0).r) == group_of(first);
        }
        vec4 depth;
        for (int i = 0; i < 4; i++) depth[i] = texelFetch(visible_depth, corner + last * ivec2(i == 1 || i == 2, i < 2), 0).r;
        is_even = is_even && is_flat(depth);
    }
    if (SHOWS_LIGHTS && may_show_light(direction_at(vec2(pixel) + 0.5), 2.0 * length(push.up) / push.size.y)) is_even = false;
    uint item = pixel.x | pixel.y << 16;
    if (!is_even) pixels[push.capacity - 1 - atomicAdd(counts[1], 1)] = item;
    else if (first != NO_TRIANGLE && (first & BY_RAYS) != 0) pixels[atomicAdd(counts[0], 1)] = item;
}
