// direct: light that reaches the receivers without meeting a caster, averaged over the texels.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
TRIANGLES(0)
NODES(1)
LIGHTS(2)
PLANAR_RECEIVERS(3)
layout(binding = 4) uniform sampler2D environment;
layout(binding = 5, rgba32f) uniform writeonly image2D direct_map;
layout(std430, binding = 6) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 7) readonly buffer AtlasSamples_ { AtlasSamples atlas_samples[]; };
layout(push_constant) uniform DirectPush {
    uvec2 first;         // first texel of this rectangle in the receiver's tile
    uint receiver;
    uint triangle;       // one of the receiver's triangles
    uint light_count;      // 0: the environment only
    uint has_environment;
    float rotation;
    uint is_mesh;      // 1: the receiver is a mesh
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "atlas_samples.glsl"
#include "sampling.glsl"
#include "environment.glsl"
#include "lighting.glsl"

// Irradiance of a mesh receiver's texel: the mean over the points of its quarters, which share the rays. The next
// quarter replaces an empty one.
vec3 mesh_irradiance(AtlasSamples points) {
    vec3 sum = vec3(0.0);
    for (uint part = 0; part < 4; part++) {
        uint quarter = part;
        for (uint i = 0; i < 3 && points.triangles[quarter] == NO_TRIANGLE; i++) quarter = (quarter + 1) % 4;
        uint self = points.triangles[quarter];
        if (self == NO_TRIANGLE) return vec3(0.0);
        vec3 x = sample_point(points, int(quarter));
        vec3 n = normalize(cross(triangle_at(self).edge1, triangle_at(self).edge2));
        for (uint light = 0; light < push.light_count; light++) sum += direct_light(light, x, n, self, part, DIRECT_RAYS_SIDE, 4) / 4.0;
        if (push.has_environment != 0) {
            sum += direct_environment(x, n, self, part, 4, DIRECT_ENVIRONMENT_RAYS, push.rotation) / 4.0;
        }
    }
    return sum;
}

void main() {
    if (push.is_mesh != 0) {
        MeshReceiver receiver = mesh_receivers[push.receiver];
        uvec2 texel = push.first + gl_GlobalInvocationID.xy;
        if (texel.x >= receiver.width || texel.y >= receiver.height) return;
        vec3 found = mesh_irradiance(atlas_samples[receiver.first_texel + texel.x + texel.y * receiver.width]);
        imageStore(direct_map, ivec2(texel + uvec2(receiver.tile_x, receiver.tile_y)), vec4(found, 0.0));
        return;
    }
    PlanarReceiver receiver = planar_receiver_at(push.receiver);
    uvec2 texel = push.first + gl_GlobalInvocationID.xy;
    if (texel.x >= receiver.width || texel.y >= receiver.height) return;
    uvec2 place = texel + uvec2(receiver.tile_x, receiver.tile_y);
    vec3 n = receiver.normal;
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < DIRECT_RAYS_SIDE * DIRECT_RAYS_SIDE; i++) {
        vec2 within = (vec2(i % DIRECT_RAYS_SIDE, i / DIRECT_RAYS_SIDE) + 0.5) / float(DIRECT_RAYS_SIDE);
        vec3 x = from_texels(receiver, vec2(place) + within);
        // 7 i mod 16 spreads neighbouring points over the disc.
        uint ray = 7 * i % (DIRECT_RAYS_SIDE * DIRECT_RAYS_SIDE);
        for (uint light = 0; light < push.light_count; light++) {
            sum += direct_light(light, x, n, push.triangle, ray, 1, DIRECT_RAYS_SIDE * DIRECT_RAYS_SIDE) / float(DIRECT_RAYS_SIDE * DIRECT_RAYS_SIDE);
        }
    }
    if (push.has_environment != 0) {
        vec3 x = from_texels(receiver, vec2(place) + 0.5);
        sum += direct_environment(x, n, push.triangle, 0, 1, DIRECT_ENVIRONMENT_RAYS, push.rotation);
    }
    imageStore(direct_map, ivec2(place), vec4(sum, 0.0));
}
