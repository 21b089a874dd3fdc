// environment rays: irradiance of rects from the environment. Every texel has rays to one cell of each group, and its neighbours in
// a block of DIRECT_CELLS_SIDE^2 texels have rays to the others (Keller & Heidrich 2001). In three of four blocks, a texel takes over
// what the texels around it with rays to the same cells agree on. Alpha is what environment_shadow.glsl describes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
TRIANGLES(0)
NODES(1)
SURFACES(2)
DIRECT_CELLS_OF(3)
layout(binding = 4, rgba32f) uniform writeonly image2D environment_rays;
layout(binding = 5) uniform sampler2D known_rays; // the same image: texels of the parts before this one
layout(push_constant) uniform DirectEnvironmentPush {
    uvec2 first;         // first thread of this rectangle
    uint surface;
    uint part;           // of ENVIRONMENT_PARTS
} push;

#include "trace.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "direct_cells.glsl"
#include "environment_shadow.glsl"

// Columns and rows of the blocks of each part, modulo 2: the second part is diagonally between blocks of the first.
const uvec2 BLOCKS_OF_PARTS[ENVIRONMENT_PARTS] = { uvec2(0, 0), uvec2(1, 1), uvec2(1, 0), uvec2(0, 1) };

// Blocks around a block: those before the second part, and those before the last two parts.
const ivec2 DIAGONAL[4] = { ivec2(-1, -1), ivec2(1, -1), ivec2(-1, 1), ivec2(1, 1) };
const ivec2 BESIDE[4] = { ivec2(0, 1), ivec2(1, 0), ivec2(0, -1), ivec2(-1, 0) };

void main() {
    DiffuseSurface surface = surface_at(push.surface);
    PlanarReceiver plane = plane_of(surface);
    // A workgroup has the upper or the lower half of GROUP_SIDE blocks. Neighbouring threads have the same cells, so that their rays
    // stay together.
    uvec2 thread = gl_LocalInvocationID.xy;
    uvec2 group = gl_WorkGroupID.xy + push.first / GROUP_SIDE;
    uvec2 block = 2 * uvec2(group.x * GROUP_SIDE + thread.x, group.y / 2) + BLOCKS_OF_PARTS[push.part];
    uvec2 place = uvec2(thread.y % DIRECT_CELLS_SIDE, group.y % 2 * (DIRECT_CELLS_SIDE / 2) + thread.y / DIRECT_CELLS_SIDE);
    uvec2 texel = DIRECT_CELLS_SIDE * block + place;
    ivec2 size = ivec2(environment_size(surface));
    if (texel.x >= size.x || texel.y >= size.y) return;
    ivec2 tile = ivec2(plane.tile_x, plane.tile_y);
    vec3 x = from_texels(plane, vec2(tile) + (vec2(texel) + 0.5) * float(surface.environment_scale));
    Shadows around = Shadows(ALL_GROUPS, 0, 0);
    for (int i = 0; i < 4 && push.part > 0; i++) {
        ivec2 at = ivec2(texel) + int(DIRECT_CELLS_SIDE) * (push.part == 1 ? DIAGONAL[i] : BESIDE[i]);
        bool is_inside = all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size));
        if (is_inside) include(around, texelFetch(known_rays, tile + at, 0).a);
    }
    uint dark = around.count > 1 ? around.all : 0;
    uint lit = around.count > 1 ? ~around.any : 0;
    uint first = place.y * DIRECT_CELLS_SIDE + place.x;
    vec3 open = vec3(0.0);
    vec3 sum = vec3(0.0);
    uint unknown = 0;
    for (uint group = 0; group < DIRECT_CELL_GROUPS; group++) {
        vec3 light = open_irradiance(direct_cell_at(group * CELLS_OF_GROUP + first), plane.normal);
        open += light;
        if (light == vec3(0.0) || (lit >> group & 1) != 0) sum += light;
        else if ((dark >> group & 1) == 0) unknown |= 1u << group;
    }
    while (unknown != 0) {
        uint group = findLSB(unknown);
        unknown &= unknown - 1;
        DirectCell cell = direct_cell_at(group * CELLS_OF_GROUP + first);
        if (is_cell_occluded(cell, x, plane.normal, surface.triangle)) dark |= 1u << group;
        else sum += open_irradiance(cell, plane.normal);
    }
    float share = dot(open, vec3(1.0)) > 0.0 ? 1.0 - dot(sum, vec3(1.0)) / dot(open, vec3(1.0)) : 0.0;
    float shadow = share == 1.0 ? NO_LIGHT : shadow_of(dark, clamp(share, 0.0, 1.0));
    imageStore(environment_rays, tile + ivec2(texel), vec4(float(DIRECT_CELLS_SIDE * DIRECT_CELLS_SIDE) * sum, shadow));
}
