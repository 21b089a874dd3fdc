// count landings: counts the mesh footprints of each landing of a chain on mesh receivers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
OBJECTS(2)
LIGHTS(3)
CHAIN_PATHS(4) // landings
layout(std430, binding = 5) buffer LandingHits { ChainHit landing_hits[]; };
layout(std430, binding = 6) readonly buffer LandingSizes { uint landing_sizes[]; };
layout(std430, binding = 7) writeonly buffer Numbers { uvec2 numbers[]; }; // mesh footprints; 0
layout(std430, binding = 8) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 9) readonly buffer AtlasNodes { AtlasNode atlas_nodes[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "optics.glsl"
#include "media.glsl"
#include "planar_receiver.glsl"
#include "kernel.glsl"
#include "chain_ray.glsl"
#include "chain.glsl"
#include "light_beam.glsl"
#include "chain_landing.glsl"

void main() {
    uint index = thread_index();
    if (index >= landing_sizes[UNITS_WORD]) return;
    ChainHit hit = landing_hits[index];
    uint count = 0;
    if (hit.footprints != 0) {
        ChainPath path = path_at(index);
        for (uint mesh = 0; mesh < push.mesh_count; mesh++) {
            MeshReceiver receiver = mesh_receivers[mesh];
            uint parts = parts_on(receiver, path, hit);
            for (uint part = 0; part < parts; part++) {
                count += touch_nodes(receiver, beam_of(path, hit, offset_of(path, part, parts)), CHAIN_SUPPORT);
            }
        }
    }
    landing_hits[index].footprints = count;
    numbers[index] = uvec2(count, 0);
}
