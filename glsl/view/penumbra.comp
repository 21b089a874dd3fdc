// penumbra: direct light of the listed texels from the lights that reach them in part, by rays.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NODES(1)
LIGHTS(2)
SURFACES(3)
layout(std430, binding = 4) readonly buffer TexelCounts { uint texel_counts[]; };
layout(std430, binding = 5) readonly buffer Texels { uvec2 texels[]; };
layout(binding = 6, rgba32f) uniform image2D direct_map;
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
#include "work_list.glsl"

// Mean irradiance of a texel over Light.power: by four rays, and unless these are all dark or all lit by twelve
// more.
float texel_irradiance(Light light, DiffuseSurface surface, PlanarReceiver plane, vec2 place) {
    float sum = 0.0;
    uint lit = 0;
    for (uint i = 0; i < LIGHT_RAYS; i++) {
        if (i == 4 && (lit == 0 || lit == 4)) return sum / 4.0;
        // Rays 4 j to 4 j + 3 are in different quarters of the texel.
        uvec2 cell = uvec2(2 * (i & 1) + (i >> 2 & 1), (i & 2) + (i >> 3));
        uint k = cell.y * LIGHT_RAYS_SIDE + cell.x;
        vec2 within = (vec2(cell) + 0.5) / float(LIGHT_RAYS_SIDE);
        // 7 k mod 16 spreads neighbouring points over the disc.
        float found = ray_irradiance(light, from_texels(plane, place + within), plane.normal, surface.triangle, 7 * k % LIGHT_RAYS, LIGHT_RAYS);
        sum += found;
        lit += found > 0.0 ? 1 : 0;
    }
    return sum / float(LIGHT_RAYS);
}

void main() {
    uint item = push.first + group_index() * SPLAT_GROUP + gl_LocalInvocationIndex;
    if (item >= texel_counts[0]) return;
    ivec2 texel = ivec2(texels[item].x & 0xffffu, texels[item].x >> 16);
    DiffuseSurface surface = surface_at(texels[item].y);
    PlanarReceiver plane = plane_of(surface);
    vec4 found = imageLoad(direct_map, texel);
    uint mixed = uint(found.a);
    for (uint i = 0; i < push.light_count; i++) {
        // The last bit is for all further lights.
        if ((mixed >> min(i, MASKED_LIGHTS) & 1u) != 0) found.rgb += light_at(i).power * texel_irradiance(light_at(i), surface, plane, vec2(texel));
    }
    imageStore(direct_map, texel, vec4(found.rgb, 0.0));
}
