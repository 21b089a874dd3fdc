// project landings: writes the mesh footprints of the landings of chains whose numbers are in a batch, and the arguments of its draw.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
OBJECTS(2)
LIGHTS(3)
CHAIN_PATHS(4) // landings
layout(std430, binding = 5) readonly buffer LandingHits { ChainHit landing_hits[]; };
layout(std430, binding = 6) readonly buffer LandingSizes { uint landing_sizes[]; };
layout(std430, binding = 7) readonly buffer Numbers { uvec2 numbers[]; }; // prefix sums
layout(std430, binding = 8) readonly buffer BlockSums { uvec2 block_sums[]; };
layout(std430, binding = 9) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 10) readonly buffer AtlasNodes { AtlasNode atlas_nodes[]; };
layout(std430, binding = 11) readonly buffer Profiles { Profile profiles[]; };
layout(std430, binding = 12) readonly buffer Spectrum { vec4 weights_below[]; };
layout(std430, binding = 13) writeonly buffer MeshFootprints { MeshFootprint mesh_footprints[]; };
layout(std430, binding = 14) buffer FluxSums { uint flux_sums[]; };
layout(std430, binding = 15) readonly buffer Totals { uint totals[]; };
layout(std430, binding = 16) writeonly buffer Arguments { uint arguments[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "dispatch_arguments.glsl"
#include "optics.glsl"
#include "media.glsl"
#include "planar_receiver.glsl"
#include "kernel_fit.glsl"
#include "chain_ray.glsl"
#include "chain.glsl"
#include "spectrum.glsl"
#include "chain_flux.glsl"
#include "light_beam.glsl"
#include "node_footprint.glsl"
#include "chain_landing.glsl"

// A mesh footprint without extent.
MeshFootprint no_mesh_footprint() {
    vec3 zero = vec3(0.0);
    return MeshFootprint(zero, 0.0, zero, 0.0, zero, 0, zero, 0, zero, 0.0, zero, 0, zero, 0, zero, 0.0);
}

void write(uint place, MeshFootprint footprint) {
    uint in_batch = place - push.first_mesh_splat;
    if (in_batch < push.mesh_splat_batch) mesh_footprints[in_batch] = footprint;
}

// Writes the mesh footprints of a landing that are in the batch: those from number `place` to `end` of all.
void project(uint index, ChainHit hit, uint place, uint end) {
    ChainPath path = path_at(index);
    vec3 occluder = vec3(0.0);
    vec3 occluder_normal = vec3(0.0);
    if (hit.triangle != NO_TRIANGLE) {
        occluder = path.position + hit.distance * path.direction;
        occluder_normal = normal_against(triangle_at(hit.triangle), path.direction);
    }
    uint last = min(end, push.first_mesh_splat + push.mesh_splat_batch);
    // A landing has all of its footprints or none.
    bool has_room = end <= push.mesh_splat_capacity;
    for (uint mesh = 0; has_room && mesh < push.mesh_count; mesh++) {
        MeshReceiver receiver = mesh_receivers[mesh];
        vec3 flux = flux_after(path, distance_to(receiver, path, hit));
        uint parts = parts_on(receiver, path, hit);
        for (uint part = 0; part < parts; part++) {
            LightBeam beam = beam_of(path, hit, offset_of(path, part, parts));
            vec3 of_part = flux;
            if (DISPERSES && (parts > 1 || band_of(path).y < 1.0)) {
                of_part *= colour_between(path, float(part) / float(parts), float(part + 1) / float(parts));
            }
            uint count = touch_nodes(receiver, beam, CHAIN_SUPPORT);
            for (uint i = 0; i < count && place < last; i++) {
                MeshFootprint footprint;
                bool is_lit = project_to_node(receiver, unpacked(touched[i]), beam, of_part, occluder, occluder_normal, footprint);
                if (!is_lit) footprint = no_mesh_footprint();
                write(place++, footprint);
            }
        }
    }
    for (; place < last; place++) write(place, no_mesh_footprint());
}

#define BLOCK_FOOTPRINTS(i) block_sums[i].x

// The threads take turns at the landings, from the block on in which the batch begins until it ends.
void main() {
    uint thread = thread_index();
    if (thread == 0) {
        uint all = min(totals[UNITS_WORD], push.mesh_splat_capacity);
        WRITE_DRAW(arguments, 0, min(max(all, push.first_mesh_splat) - push.first_mesh_splat, push.mesh_splat_batch))
    }
    uint landings = landing_sizes[UNITS_WORD];
    SEARCH(block, 0, (landings + SPLAT_GROUP - 1) / SPLAT_GROUP, push.first_mesh_splat, BLOCK_FOOTPRINTS)
    uint threads = gl_NumWorkGroups.x * gl_NumWorkGroups.y * SPLAT_GROUP;
    for (uint index = block * SPLAT_GROUP + thread; index < landings; index += threads) {
        ChainHit hit = landing_hits[index];
        uint place = numbers[index].x + block_sums[index / SPLAT_GROUP].x;
        uint end = place + hit.footprints;
        if (COUNTS_FLUX) {
            if (end > push.mesh_splat_capacity) count_no_room_on_meshes(path_at(index), hit);
            continue;
        }
        if (place >= push.first_mesh_splat + push.mesh_splat_batch) break;
        if (place < end && end > push.first_mesh_splat) project(index, hit, place, end);
    }
}
