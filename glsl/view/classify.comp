// classify: blocks of texels of a rect's direct map that suns and lamps light as a whole or not at all.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NODES(1)
LIGHTS(2)
SURFACES(3)
layout(std430, binding = 4) readonly buffer BlockSurfaces { uint block_surfaces[]; };
layout(std430, binding = 5) writeonly buffer Blocks { uint blocks[]; };
layout(push_constant) uniform ClassifyPush {
    uint first;          // first block
    uint block_count;    // number of all blocks
    uint light_count;
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "sampling.glsl"
#include "open_light.glsl"
#include "beam.glsl"
#include "lighting.glsl"

void main() {
    uint index = push.first + gl_GlobalInvocationID.x;
    if (index >= push.block_count) return;
    DiffuseSurface surface = surface_at(block_surfaces[index]);
    PlanarReceiver plane = plane_of(surface);
    uvec2 block = place_of_block(surface, index);
    vec2 low = vec2(plane.tile_x, plane.tile_y) + vec2(block * BLOCK);
    vec2 high = min(low + float(BLOCK), vec2(plane.tile_x + plane.width, plane.tile_y + plane.height));
    vec3 x = from_texels(plane, 0.5 * (low + high));
    vec2 part = 0.5 * (high - low) / vec2(plane.width, plane.height);
    uint words = (push.light_count + LIGHTS_PER_WORD - 1) / LIGHTS_PER_WORD;
    uint word = 0;
    uint place = index * words;
    for (uint i = 0; i < push.light_count; i++) {
        Light light = light_at(i);
        LightDisc disc = disc_at(light, x);
        uint shade = IS_LIT;
        // A lamp may be above the horizon of a part of the block only.
        if (!is_below(disc, plane.normal) || light.is_lamp != 0) {
            shade = trace_beam(beam_to(light, disc, x, plane.normal, part.x * plane.edge_u, part.y * plane.edge_v, ROUNDING), false);
            bool all_dark = shade != IS_LIT;
            for (uint k = 0; all_dark && k < LIGHT_RAYS; k++) {
                vec2 within = (vec2(k % LIGHT_RAYS_SIDE, k / LIGHT_RAYS_SIDE) + 0.5) / float(LIGHT_RAYS_SIDE);
                vec3 at = from_texels(plane, mix(low, high, within));
                all_dark = ray_irradiance(light, at, plane.normal, surface.triangle, 7 * k % LIGHT_RAYS, LIGHT_RAYS) == 0.0;
            }
            if (all_dark) shade = IS_DARK;
        }
        word |= shade << 2 * (i % LIGHTS_PER_WORD);
        if (i % LIGHTS_PER_WORD == LIGHTS_PER_WORD - 1 || i + 1 == push.light_count) {
            blocks[place + i / LIGHTS_PER_WORD] = word;
            word = 0;
        }
    }
}
