// sharp sky: rays of their own for the listed texels of the sky map.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 64) in;
TRIANGLES(0)
NODES(1)
SURFACES(2)
SKY_CELL_BUFFER(3)
layout(std430, binding = 4) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 5) readonly buffer Items { uvec2 items[]; };
layout(binding = 6, rgba32f) uniform writeonly image2D sky_map;
layout(push_constant) uniform ListedPush {
    uint first;          // first item
    uint light_count;
} push;

#include "trace.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "sky.glsl"
#include "work_list.glsl"

void main() {
    uint item = push.first + group_index() * 64 + gl_LocalInvocationIndex;
    if (item >= counts[0]) return;
    uvec2 texel = uvec2(items[item].x & 0xffffu, items[item].x >> 16);
    DiffuseSurface surface = surface_at(items[item].y);
    PlanarReceiver plane = plane_of(surface);
    uvec2 tile = uvec2(plane.tile_x, plane.tile_y);
    vec3 x = from_texels(plane, vec2(tile) + (vec2(texel) + 0.5) * float(surface.sky_scale));
    vec3 found = sky_irradiance(x, plane.normal, surface.triangle, (texel.x + texel.y) % SKY_STEP, SKY_STEP, SKY_CELLS);
    imageStore(sky_map, ivec2(tile + texel), vec4(found, 1.0));
}
