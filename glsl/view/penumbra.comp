// penumbra: direct light of the listed texels from the listed lights, in place of that of the one ray of mixed_blocks.comp: by four
// rays, and by twelve more of the texels that a light then reaches in part, which are listed for them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NODES(1)
LIGHTS(2)
SURFACES(3)
layout(std430, binding = 4) readonly buffer BlockSurfaces { uint block_surfaces[]; };
layout(std430, binding = 5) readonly buffer Blocks { uint blocks[]; };
layout(std430, binding = 6) readonly buffer TexelCounts { uint texel_counts[]; };
layout(std430, binding = 7) readonly buffer Texels { uvec2 texels[]; };
layout(std430, binding = 8) buffer RestCounts { uint rest_counts[]; };
layout(std430, binding = 9) writeonly buffer Rest { uvec2 rest[]; };
layout(binding = 10, rgba32f) uniform image2D direct_map;
layout(push_constant) uniform PenumbraPush {
    uint first;          // first item
    uint light_count;
    uint is_rest;        // whether the listed texels have had their first rays
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "blocks_of_light.glsl"
#include "sampling.glsl"
#include "open_light.glsl"
#include "lighting.glsl"
#include "texel_light.glsl"
#include "work_list.glsl"

const uint FIRST_RAYS = 4;

void main() {
    uint item = push.first + group_index() * SPLAT_GROUP + gl_LocalInvocationIndex;
    if (item >= texel_counts[0]) return;
    uvec2 listed = texels[item];
    bool is_first = push.is_rest == 0;
    uint block = listed.x / (BLOCK * BLOCK);
    DiffuseSurface surface = surface_at(block_surfaces[block]);
    PlanarReceiver plane = plane_of(surface);
    vec2 place = vec2(plane.tile_x, plane.tile_y) + vec2(texel_of_block(surface, block, listed.x % (BLOCK * BLOCK)));
    vec4 found = imageLoad(direct_map, ivec2(place));
    uint lit = uint(found.a);
    vec3 x = from_texels(plane, place + 0.5);
    uint mixed = 0;
    for (uint i = 0; i < push.light_count; i++) {
        bool is_masked = i < MASKED_LIGHTS;
        // The last bit is for all further lights, which get all rays at once.
        if ((listed.y >> min(i, MASKED_LIGHTS) & 1u) == 0) continue;
        Light light = light_at(i);
        uint begin = is_first ? 0 : FIRST_RAYS;
        uint end = is_first && is_masked ? FIRST_RAYS : LIGHT_RAYS;
        float sum = 0.0;
        uint lit_rays = 0;
        for (uint k = begin; k < end; k++) {
            float irradiance = texel_ray(light, surface, plane, place, k);
            sum += irradiance;
            lit_rays += uint(irradiance > 0.0);
        }
        bool is_mixed = is_first && is_masked && lit_rays % FIRST_RAYS != 0;
        mixed |= uint(is_mixed) << i;
        float irradiance = sum / float(is_first && is_masked && !is_mixed ? FIRST_RAYS : LIGHT_RAYS);
        // The first rays replace what was found before.
        bool is_counted = is_first && (is_masked ? (lit >> i & 1u) != 0 : shade_of(block, i, push.light_count) == IS_LIT);
        if (is_counted) irradiance -= open_irradiance(disc_at(light, x), plane.normal);
        found.rgb += light.power * irradiance;
    }
    imageStore(direct_map, ivec2(place), vec4(max(found.rgb, 0.0), found.a));
    if (mixed != 0) rest[atomicAdd(rest_counts[0], 1)] = uvec2(listed.x, mixed);
}
