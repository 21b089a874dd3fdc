// direct atlas: direct light of the texels of a mesh's light map.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
LIGHTS(3)
SURFACES(4)
layout(std430, binding = 5) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 6) readonly buffer AtlasSamples_ { AtlasSamples atlas_samples[]; };
DIRECT_CELLS_OF(7)
layout(binding = 8, rgba32f) uniform writeonly image2D direct_map;
layout(push_constant) uniform DirectPush {
    uvec2 first;         // first texel of this rectangle in the surface's tile
    uint surface;
    uint receiver;       // of kind ATLAS: index among the mesh receivers
    uint light_count;
    uint direct_cell_count; // 0: no environment
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "atlas_samples.glsl"
#include "sampling.glsl"
#include "open_light.glsl"
#include "lighting.glsl"
#include "direct_cells.glsl"

// Irradiance of a mesh receiver's texel: the mean over the points of its quarters, which share the rays. The next
// quarter replaces an empty one. `parity`: which half of the environment's cells the texel has rays to.
vec3 atlas_irradiance(AtlasSamples points, uint parity) {
    vec3 sum = vec3(0.0);
    for (uint part = 0; part < 4; part++) {
        uint quarter = part;
        for (uint i = 0; i < 3 && points.triangles[quarter] == NO_TRIANGLE; i++) quarter = (quarter + 1) % 4;
        uint self = points.triangles[quarter];
        if (self == NO_TRIANGLE) return vec3(0.0);
        Triangle triangle = triangle_at(self);
        Normals corner = normals_at(self);
        vec2 w = unpackUnorm2x16(points.weights[quarter]);
        vec3 x = on_smooth_surface(triangle, corner, sample_point(points, int(quarter)), w);
        vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
        for (uint i = 0; i < push.light_count; i++) {
            Light light = light_at(i);
            if (is_below(disc_at(light, x), n)) continue;
            for (uint k = part; k < POINT_LIGHT_RAYS; k += 4) {
                sum += light.power * ray_irradiance(light, x, n, self, k, POINT_LIGHT_RAYS) / float(POINT_LIGHT_RAYS);
            }
        }
        sum += cells_irradiance(x, n, self, DIRECT_CELLS_STEP * part + parity, 4 * DIRECT_CELLS_STEP, push.direct_cell_count > 0 ? DIRECT_CELLS : 0) / 4.0;
    }
    return sum;
}

void main() {
    DiffuseSurface surface = surface_at(push.surface);
    uvec2 texel = push.first + gl_GlobalInvocationID.xy;
    if (texel.x >= surface.width || texel.y >= surface.height) return;
    MeshReceiver receiver = mesh_receivers[push.receiver];
    vec3 found = atlas_irradiance(atlas_samples[receiver.first_texel + texel.x + texel.y * receiver.width], (texel.x + texel.y) % DIRECT_CELLS_STEP);
    imageStore(direct_map, ivec2(texel + uvec2(surface.tile_x, surface.tile_y)), vec4(found, 0.0));
}
