// sharp environment: listed texels of the direct map of the environment, each by its own rays to many cells.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NODES(1)
SURFACES(2)
DIRECT_CELLS_OF(3)
layout(std430, binding = 4) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 5) readonly buffer Items { uvec2 items[]; };
layout(binding = 6, rgba32f) uniform writeonly image2D environment_direct_map;
layout(push_constant) uniform ListedPush {
    uint first;          // first item
    uint light_count;
} push;

#include "trace.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "direct_cells.glsl"
#include "work_list.glsl"

void main() {
    uint item = push.first + group_index() * SPLAT_GROUP + gl_LocalInvocationIndex;
    if (item >= counts[0]) return;
    uvec2 texel = uvec2(items[item].x & 0xffffu, items[item].x >> 16);
    DiffuseSurface surface = surface_at(items[item].y);
    PlanarReceiver plane = plane_of(surface);
    uvec2 tile = uvec2(plane.tile_x, plane.tile_y);
    vec3 x = from_texels(plane, vec2(tile) + (vec2(texel) + 0.5) * float(surface.environment_scale));
    vec3 found = cells_irradiance(x, plane.normal, surface.triangle, (texel.x + texel.y) % DIRECT_CELLS_STEP, DIRECT_CELLS_STEP, DIRECT_CELLS);
    imageStore(environment_direct_map, ivec2(tile + texel), vec4(found, 1.0));
}
