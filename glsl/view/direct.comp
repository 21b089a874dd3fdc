// direct: direct light of the texels of a rect's tile of the direct map, from lights that light their block as a whole, and
// from the smooth direct map of the environment. Alpha has the bits of these lights.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
LIGHTS(0)
SURFACES(1)
layout(std430, binding = 2) readonly buffer Blocks { uint blocks[]; };
layout(binding = 3) uniform sampler2D environment_direct_map;
layout(binding = 4, rgba32f) uniform writeonly image2D direct_map;
layout(constant_id = ID_HAS_ENVIRONMENT) const bool HAS_ENVIRONMENT = true;
layout(push_constant) uniform DirectPush {
    uvec2 first;         // first texel of this rectangle in the surface's tile
    uint surface;
    uint receiver;       // of kind ATLAS: index among the mesh receivers
    uint light_count;
} push;

#include "light.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "blocks_of_light.glsl"
#include "open_light.glsl"
#include "look_up.glsl"

void main() {
    DiffuseSurface surface = surface_at(push.surface);
    PlanarReceiver plane = plane_of(surface);
    uvec2 texel = push.first + gl_GlobalInvocationID.xy;
    if (texel.x >= surface.width || texel.y >= surface.height) return;
    vec2 tile = vec2(plane.tile_x, plane.tile_y);
    vec3 x = from_texels(plane, tile + vec2(texel) + 0.5);
    uvec2 block = texel / BLOCK;
    uint index = surface.first_block + block.y * block_counts(surface).x + block.x;
    vec3 sum = vec3(0.0);
    uint lit = 0;
    for (uint i = 0; i < push.light_count; i++) {
        bool is_lit = shade_of(index, i, push.light_count) == IS_LIT;
        sum += is_lit ? light_at(i).power * open_irradiance(disc_at(light_at(i), x), plane.normal) : vec3(0.0);
        if (is_lit && i < MASKED_LIGHTS) lit |= 1u << i;
    }
    if (HAS_ENVIRONMENT) {
        vec2 at = tile + (vec2(texel) + 0.5) / float(surface.environment_scale);
        sum += look_up_smooth(environment_direct_map, tile, environment_size(surface), at);
    }
    imageStore(direct_map, ivec2(tile) + ivec2(texel), vec4(sum, float(lit)));
}
