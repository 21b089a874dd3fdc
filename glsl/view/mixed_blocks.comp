// mixed blocks: direct light of the texels of blocks that a sun or lamp lights in part, in place of that of direct.comp. A beam
// decides whether a light reaches the whole texel or none of it; other texels are listed for rays. Their alpha has the bits
// of the lights that need rays.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = BLOCK, local_size_y = BLOCK) in;
TRIANGLES(0)
NODES(1)
LIGHTS(2)
SURFACES(3)
layout(std430, binding = 4) readonly buffer BlockSurfaces { uint block_surfaces[]; };
layout(std430, binding = 6) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 7) readonly buffer Items { uvec2 items[]; };
layout(std430, binding = 10) buffer TexelCounts { uint texel_counts[]; };
layout(std430, binding = 11) writeonly buffer Texels { uvec2 texels[]; };
layout(binding = 8) uniform sampler2D environment_direct_map;
layout(binding = 9, rgba32f) uniform writeonly image2D direct_map;
layout(constant_id = ID_HAS_ENVIRONMENT) const bool HAS_ENVIRONMENT = true;
layout(push_constant) uniform ListedPush {
    uint first;          // first item
    uint light_count;
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "open_light.glsl"
#include "beam.glsl"
#include "look_up.glsl"
#include "work_list.glsl"

void main() {
    uint item = push.first + group_index();
    if (item >= counts[0]) return;
    uint index = items[item].x;
    uint object = block_surfaces[index];
    DiffuseSurface surface = surface_at(object);
    PlanarReceiver plane = plane_of(surface);
    uvec2 texel = place_of_block(surface, index) * BLOCK + gl_LocalInvocationID.xy;
    if (texel.x >= surface.width || texel.y >= surface.height) return;
    vec2 tile = vec2(plane.tile_x, plane.tile_y);
    vec2 place = tile + vec2(texel);
    vec3 x = from_texels(plane, place + 0.5);
    vec2 part = 0.5 / vec2(plane.width, plane.height);
    vec3 sum = vec3(0.0);
    uint mixed = push.light_count > MASKED_LIGHTS ? 1u << MASKED_LIGHTS : 0u;
    for (uint i = 0; i < min(push.light_count, MASKED_LIGHTS); i++) {
        Light light = light_at(i);
        LightDisc disc = disc_at(light, x);
        bool is_cut_off = is_cut(disc, plane.normal);
        uint shade = trace_beam(beam_to(light, disc, x, plane.normal, part.x * plane.edge_u, part.y * plane.edge_v, ROUNDING), true);
        if (is_below(disc, plane.normal)) continue;
        if (shade == IS_LIT && !is_cut_off) sum += light.power * open_irradiance(disc, plane.normal);
        else if (shade != IS_DARK) mixed |= 1u << i;
    }
    if (HAS_ENVIRONMENT) {
        vec2 at = tile + (vec2(texel) + 0.5) / float(surface.environment_scale);
        sum += look_up_smooth(environment_direct_map, tile, environment_size(surface), at);
    }
    imageStore(direct_map, ivec2(place), vec4(sum, float(mixed)));
    if (mixed != 0) texels[atomicAdd(texel_counts[0], 1)] = uvec2(uint(place.x) | uint(place.y) << 16, object);
}
