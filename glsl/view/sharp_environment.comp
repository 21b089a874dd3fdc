// sharp environment: listed texels of the direct map of the environment, each by its own rays: to groups of cells that are in
// shadow at some of its neighbours and in view at others.
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
layout(binding = 7) uniform sampler2D environment_rays;
layout(std430, binding = 8) readonly buffer OpenGroups { vec4 open_groups[]; }; // DIRECT_CELL_GROUPS for each object, W/m^2
layout(push_constant) uniform ListedPush {
    uint first;          // first item
    uint light_count;
} push;

#include "trace.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "direct_cells.glsl"
#include "environment_shadow.glsl"
#include "work_list.glsl"

void main() {
    uint item = push.first + group_index() * SPLAT_GROUP + gl_LocalInvocationIndex;
    if (item >= counts[0]) return;
    ivec2 texel = ivec2(items[item].x & 0xffffu, items[item].x >> 16);
    DiffuseSurface surface = surface_at(items[item].y);
    PlanarReceiver plane = plane_of(surface);
    ivec2 tile = ivec2(plane.tile_x, plane.tile_y);
    ivec2 size = ivec2(environment_size(surface));
    vec3 x = from_texels(plane, vec2(tile) + (vec2(texel) + 0.5) * float(surface.environment_scale));
    Shadows around = Shadows(ALL_GROUPS, 0, 0);
    for (int i = 0; i < 25; i++) {
        ivec2 at = clamp(texel + ivec2(i % 5, i / 5) - 2, ivec2(0), size - 1);
        include(around, texelFetch(environment_rays, tile + at, 0).a);
    }
    vec3 sum = vec3(0.0);
    for (uint group = 0; group < DIRECT_CELL_GROUPS; group++) {
        if ((around.any >> group & 1) == 0) sum += open_groups[items[item].y * DIRECT_CELL_GROUPS + group].rgb;
    }
    // A ray to one of every DIRECT_CELLS_STEP consecutive cells. Which of these changes with the ray and the group: otherwise all rays
    // of a texel would miss what is on the same side of an edge.
    uint first = (texel.x + texel.y) % DIRECT_CELLS_STEP;
    const uint rays = CELLS_OF_GROUP / DIRECT_CELLS_STEP;
    uint unknown = around.any & ~around.all;
    for (uint ray = 0; unknown != 0;) {
        uint group = findLSB(unknown);
        uint place = (first + ray + group) % DIRECT_CELLS_STEP;
        DirectCell cell = direct_cell_at(group * CELLS_OF_GROUP + DIRECT_CELLS_STEP * ray + place);
        vec3 light = float(DIRECT_CELLS_STEP) * open_irradiance(cell, plane.normal);
        if (light != vec3(0.0) && !is_cell_occluded(cell, x, plane.normal, surface.triangle)) sum += light;
        ray = (ray + 1) % rays;
        if (ray == 0) unknown &= unknown - 1;
    }
    imageStore(environment_direct_map, tile + texel, vec4(sum, 1.0));
}
