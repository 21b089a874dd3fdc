// smooth environment: the mean over the neighbours whose rays together go to all cells, where these see about the same of the
// environment; other texels are listed for rays of their own. Texels without any light continue their neighbours, so that
// look-ups between texels are right beside them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
SURFACES(0)
layout(binding = 1) uniform sampler2D environment_rays;
layout(binding = 2, rgba32f) uniform writeonly image2D environment_direct_map;
layout(std430, binding = 3) buffer Counts { uint counts[]; };
layout(std430, binding = 4) writeonly buffer Items { uvec2 items[]; };
layout(push_constant) uniform DirectEnvironmentPush {
    uvec2 first;         // first texel of this rectangle
    uint surface;
    uint part;           // unused
} push;

#include "surface.glsl"
#include "environment_shadow.glsl"

// Change of the share in shadow across the neighbours that is an edge of a shadow. The noise of their rays is below it.
const float EDGE_OF_SHADOW = 0.2;

void main() {
    DiffuseSurface surface = surface_at(push.surface);
    ivec2 texel = ivec2(push.first + gl_GlobalInvocationID.xy);
    ivec2 size = ivec2(environment_size(surface));
    if (texel.x >= size.x || texel.y >= size.y) return;
    ivec2 tile = ivec2(surface.tile_x, surface.tile_y);
    const int side = int(DIRECT_CELLS_SIDE);
    vec3 sum = vec3(0.0);
    float weights = 0.0;
    // The sum over the nearest neighbours only.
    vec4 near = vec4(0.0);
    // Shares in shadow to the right minus those to the left, and below minus above.
    vec2 change = vec2(0.0);
    // The outermost texels on opposite sides have rays to the same cells, and therefore half the weight.
    for (int y = -side / 2; y <= side / 2; y++) {
        for (int x = -side / 2; x <= side / 2; x++) {
            // In place of a texel beyond the edge, one inside that has rays to the same cells.
            ivec2 at = texel + ivec2(x, y);
            at += side * (ivec2(lessThan(at, ivec2(0))) - ivec2(greaterThanEqual(at, size)));
            at = clamp(at, ivec2(0), size - 1);
            vec4 rays = texelFetch(environment_rays, tile + at, 0);
            if (rays.a == NO_LIGHT) continue;
            float weight = (abs(x) == side / 2 ? 0.5 : 1.0) * (abs(y) == side / 2 ? 0.5 : 1.0);
            sum += weight * rays.rgb;
            weights += weight;
            if (max(abs(x), abs(y)) < side / 2) near += vec4(rays.rgb, 1.0);
            change += weight * share_in(rays.a) * vec2(sign(x), sign(y));
        }
    }
    vec3 found = weights > 0.0 ? sum / weights : vec3(0.0);
    bool is_covered = texelFetch(environment_rays, tile + texel, 0).a == NO_LIGHT;
    if (is_covered && near.a > 0.0) found = near.rgb / near.a;
    if (!is_covered && (weights < float(side * side) || max(abs(change.x), abs(change.y)) > EDGE_OF_SHADOW * float(side * side) / 2.0)) {
        items[atomicAdd(counts[0], 1)] = uvec2(uint(texel.x) | uint(texel.y) << 16, push.surface);
    }
    imageStore(environment_direct_map, tile + texel, vec4(found, 1.0));
}
