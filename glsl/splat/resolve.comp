// resolve: adds each coarser level of the light maps to the next finer one, interpolated. Repeated bilinear steps
// approximate a quadratic B-spline.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
PLANAR_RECEIVERS(0)
layout(std430, binding = 1) readonly buffer Coarse { uint coarse[]; }; // per receiver: bit l is set where footprints are in level l
layout(binding = 2, rgba32f) uniform image2D light_map;
layout(push_constant) uniform ResolvePush {
    int level;           // level that is added to
    int first_row;       // first row of this step, counted with the border
} push;

#include "planar_receiver.glsl"

void main() {
    uint index = gl_GlobalInvocationID.z;
    if (coarse[index] >> (push.level + 1) == 0) return;
    Level fine = level_of(planar_receiver_at(index), push.level);
    Level wide = level_of(planar_receiver_at(index), push.level + 1);
    int around = push.level > 0 ? 1 : 0;
    ivec2 size = fine.size + 2 * around;
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, push.first_row) - around;
    if (any(greaterThanEqual(texel, size - around))) return;
    // Weight 3/4 for the coarse texel that contains this one, and 1/4 for its nearest neighbour, on each axis.
    ivec2 near = texel >> 1;
    ivec2 next = near + 2 * (texel & 1) - 1;
    vec4 row = 0.75 * imageLoad(light_map, wide.origin + near)
        + 0.25 * imageLoad(light_map, wide.origin + ivec2(next.x, near.y));
    vec4 beside = 0.75 * imageLoad(light_map, wide.origin + ivec2(near.x, next.y))
        + 0.25 * imageLoad(light_map, wide.origin + next);
    ivec2 place = fine.origin + texel;
    imageStore(light_map, place, imageLoad(light_map, place) + 0.75 * row + 0.25 * beside);
}
