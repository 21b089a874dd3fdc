// environment rays: irradiance of rects from the environment. Every texel has rays to the cells of one of DIRECT_CELLS_SIDE^2
// subsets, and its neighbours have rays to those of the other subsets (Keller & Heidrich 2001). Alpha is the share of the light
// that is in shadow, or -1 for a texel without any light, such as one under an object that stands on the rect.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
TRIANGLES(0)
NODES(1)
SURFACES(2)
DIRECT_CELLS_OF(3)
layout(binding = 4, rgba32f) uniform writeonly image2D environment_rays;
layout(push_constant) uniform DirectEnvironmentPush {
    uvec2 first;         // first texel of this rectangle
    uint surface;
    uint unused;
} push;

#include "trace.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "direct_cells.glsl"

void main() {
    DiffuseSurface surface = surface_at(push.surface);
    PlanarReceiver plane = plane_of(surface);
    // A workgroup has 32 x 2 texels. Those of neighbouring threads have the same cells, so that their rays stay together.
    uvec2 thread = gl_LocalInvocationID.xy;
    uvec2 texel = gl_WorkGroupID.xy * uvec2(GROUP_SIDE * DIRECT_CELLS_SIDE, GROUP_SIDE / DIRECT_CELLS_SIDE) + uvec2(DIRECT_CELLS_SIDE * thread.x + thread.y % DIRECT_CELLS_SIDE, thread.y / DIRECT_CELLS_SIDE);
    texel += uvec2(push.first.x * DIRECT_CELLS_SIDE, push.first.y / DIRECT_CELLS_SIDE);
    uvec2 size = uvec2(environment_size(surface));
    if (texel.x >= size.x || texel.y >= size.y) return;
    uvec2 tile = uvec2(plane.tile_x, plane.tile_y);
    vec3 x = from_texels(plane, vec2(tile) + (vec2(texel) + 0.5) * float(surface.environment_scale));
    uvec2 place = texel % DIRECT_CELLS_SIDE;
    float blocked;
    vec3 found = cells_irradiance(x, plane.normal, surface.triangle, place.y * DIRECT_CELLS_SIDE + place.x, DIRECT_CELLS_SIDE * DIRECT_CELLS_SIDE, DIRECT_CELLS, blocked);
    if (blocked == 1.0) blocked = -1.0;
    imageStore(environment_rays, ivec2(tile + texel), vec4(found, blocked));
}
