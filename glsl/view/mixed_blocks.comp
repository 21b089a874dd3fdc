// mixed blocks: direct light of the texels of blocks from the suns and lamps that light the block in part, by one ray for each texel,
// of maps in motion. The bits of those that reach the texel are added to alpha.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = BLOCK, local_size_y = BLOCK) in;
TRIANGLES(0)
NODES(1)
LIGHTS(2)
SURFACES(3)
layout(std430, binding = 4) readonly buffer BlockSurfaces { uint block_surfaces[]; };
layout(std430, binding = 5) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 6) readonly buffer Items { uvec2 items[]; };
layout(binding = 7, rgba32f) uniform image2D direct_map;
layout(push_constant) uniform ListedPush {
    uint first;          // first item
    uint light_count;
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "sampling.glsl"
#include "open_light.glsl"
#include "lighting.glsl"
#include "texel_light.glsl"
#include "work_list.glsl"

void main() {
    uint item = push.first + group_index();
    if (item >= counts[0]) return;
    uint index = items[item].x;
    DiffuseSurface surface = surface_at(block_surfaces[index]);
    PlanarReceiver plane = plane_of(surface);
    uvec2 texel = texel_of_block(surface, index, gl_LocalInvocationIndex);
    if (texel.x >= surface.width || texel.y >= surface.height) return;
    uvec2 place = uvec2(plane.tile_x, plane.tile_y) + texel;
    vec4 found = imageLoad(direct_map, ivec2(place));
    uint lit = uint(found.a);
    vec3 x = from_texels(plane, vec2(place) + 0.5);
    // Each texel of a square of 2 x 2 has its ray in another quarter. Along rows and along columns, neighbours have theirs half a texel
    // nearer or farther, so that all quarters are next to every texel.
    uint ray = (texel.x + texel.y & 1u) | (texel.x & 1u) << 1;
    for (uint i = 0; i < min(push.light_count, MASKED_LIGHTS); i++) {
        if ((lit >> i & 1u) != 0) continue;
        Light light = light_at(i);
        if (texel_ray(light, surface, plane, vec2(place), ray) == 0.0) continue;
        found.rgb += light.power * open_irradiance(disc_at(light, x), plane.normal);
        lit |= 1u << i;
    }
    imageStore(direct_map, ivec2(place), vec4(found.rgb, float(lit)));
}
