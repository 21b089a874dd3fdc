// shadow edges: lists texels of mixed blocks for rays to the lights that do not light the block as a whole. Of maps in motion, whose
// texels had one ray each, only those are listed that differ from a neighbour.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = BLOCK, local_size_y = BLOCK) in;
LIGHTS(0)
SURFACES(1)
layout(std430, binding = 2) readonly buffer BlockSurfaces { uint block_surfaces[]; };
layout(std430, binding = 3) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 4) readonly buffer Items { uvec2 items[]; };
layout(std430, binding = 5) buffer TexelCounts { uint texel_counts[]; };
layout(std430, binding = 6) writeonly buffer Texels { uvec2 texels[]; }; // block and place in it, and the bits of the lights
layout(binding = 7) uniform sampler2D direct_map;
layout(push_constant) uniform ShadowEdgesPush {
    uint first;          // first item
    uint light_count;
    uint is_in_motion;
} push;

#include "light.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "open_light.glsl"
#include "work_list.glsl"

void main() {
    uint item = push.first + group_index();
    if (item >= counts[0]) return;
    uint index = items[item].x;
    DiffuseSurface surface = surface_at(block_surfaces[index]);
    PlanarReceiver plane = plane_of(surface);
    ivec2 size = ivec2(surface.width, surface.height);
    ivec2 texel = ivec2(texel_of_block(surface, index, gl_LocalInvocationIndex));
    if (texel.x >= size.x || texel.y >= size.y) return;
    ivec2 tile = ivec2(plane.tile_x, plane.tile_y);
    uint lit = uint(texelFetch(direct_map, tile + texel, 0).a);
    // The last bit is for all further lights.
    uint mixed = push.light_count > MASKED_LIGHTS ? 1u << MASKED_LIGHTS : 0u;
    uint masked = min(push.light_count, MASKED_LIGHTS);
    if (push.is_in_motion == 0) mixed |= ~lit & ((1u << masked) - 1);
    for (int k = 0; k < 9 && push.is_in_motion != 0; k++) {
        ivec2 at = clamp(texel + ivec2(k % 3, k / 3) - 1, ivec2(0), size - 1);
        mixed |= lit ^ uint(texelFetch(direct_map, tile + at, 0).a);
    }
    vec3 x = from_texels(plane, vec2(tile + texel) + 0.5);
    for (uint i = 0; i < masked; i++) mixed |= uint(is_cut(disc_at(light_at(i), x), plane.normal)) << i;
    if (mixed != 0) texels[atomicAdd(texel_counts[0], 1)] = uvec2(index * BLOCK * BLOCK + gl_LocalInvocationIndex, mixed);
}
