// finish chains: follows what is left after the last wave to its end, along one lobe of every surface, chosen in proportion to its
// light. Each path has one footprint, which is empty where it lands on no planar receiver, and one landing on mesh receivers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
OBJECTS(3)
LIGHTS(4)
PLANAR_RECEIVERS(5)
CHAIN_PATHS(7)
layout(std430, binding = 8) readonly buffer Waves { uint waves[]; };
layout(std430, binding = 9) writeonly buffer Footprints { ChainFootprint footprints[]; };
layout(std430, binding = 10) buffer Coarse { uint coarse[]; };
layout(std430, binding = 11) readonly buffer Profiles { Profile profiles[]; };
layout(std430, binding = 12) readonly buffer Spectrum { vec4 weights_below[]; };
layout(std430, binding = 13) buffer FluxSums { uint flux_sums[]; };
layout(std430, binding = 14) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 15) readonly buffer AtlasNodes { AtlasNode atlas_nodes[]; };
layout(std430, binding = 16) writeonly buffer LandingPaths { ChainPath landing_paths[]; };
layout(std430, binding = 17) writeonly buffer LandingHits { ChainHit landing_hits[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "light_part.glsl"
#include "light_piece.glsl"
#include "media.glsl"
#include "chain_hit.glsl"
#include "planar_receiver.glsl"
#include "kernel_fit.glsl"
#include "level_kernel.glsl"
#include "light_axes.glsl"
#include "chain_ray.glsl"
#include "chain.glsl"
#include "chain_changes.glsl"
#include "spectrum.glsl"
#include "chain_footprint.glsl"
#include "chain_flux.glsl"
#include "light_beam.glsl"
#include "chain_landing.glsl"

// Lands the path on the receiver that it meets, or else, where it does not go on, on the first one that only the edge of its light reaches.
// A number from 0 to 1 chooses the part of the spectrum.
bool finish(ChainPath path, ChainHit hit, bool goes_on, float number, inout ChainFootprint footprint) {
    uint tries = (goes_on ? 1 : 2) * push.receiver_count;
    for (uint i = 0; i < tries; i++) {
        uint index = i % push.receiver_count;
        PlanarReceiver receiver = planar_receiver_at(index);
        Landing landing;
        if (!land(path, hit, receiver, index, landing)) continue;
        bool is_edge = !is_in_tile(receiver, landing.centre);
        if (is_edge && i < push.receiver_count) continue;
        uint parts = parts_of(landing);
        vec3 flux = float(parts) * flux_after(path, landing.distance_);
        choose_part(landing, flux, min(uint(number * float(parts)), parts - 1), parts);
        footprint = footprint_of(landing, flux, receiver, index);
        return true;
    }
    return false;
}

void main() {
    uint index = thread_index();
    if (index >= waves[UNITS_WORD]) return;
    uint place = waves[FOOTPRINTS_WORD] + index;
    if (place >= push.splat_capacity) {
        if (COUNTS_FLUX) count_lost(path_at(index));
        return;
    }
    ChainPath path = path_at(index);
    trace_band(path);
    ChainFootprint footprint = no_footprint();
    ChainPath landing = path;
    ChainHit landing_hit = ChainHit(FAR, NO_TRIANGLE, vec2(0.0), path.media, 0, 0);
    for (;;) {
        ChainHit hit = hit_of(path);
        Interaction at;
        // The end of a path counts, or else the first mesh receiver that it passes.
        if (HAS_ATLAS && is_of_chains(path) && (landing_hit.footprints == 0 || ends_on_mesh(path, hit)) && reaches_mesh(path, hit)) {
            landing = path;
            landing_hit = hit;
            landing_hit.footprints = ON_MESHES;
        }
        bool goes_on = interfaces_of(path) < push.max_interfaces && interact(path, hit, at);
        bool lands = is_of_chains(path) && finish(path, hit, goes_on, choice(index, interfaces_of(path)), footprint);
        if (lands || !goes_on) {
            if (COUNTS_FLUX) count_end(path, hit);
            break;
        }
        Lobe lobe;
        bool refracts;
        bool is_followed = choose_lobe(path, at, choice(index, interfaces_of(path)), lobe, refracts);
        if (COUNTS_FLUX) {
            count_surface(path, at);
            if (!is_followed) count_flux(lobe.end, colour_of(path) * lobe.flux);
        }
        if (!is_followed) break;
        path = next_path(path, hit, at, transfer_to(path, hit, at), lobe, refracts);
    }
    footprints[place] = footprint;
    if (HAS_ATLAS) {
        uint number = waves[LANDINGS_WORD] + index;
        if (number < push.path_capacity) {
            landing_paths[number] = landing;
            landing_hits[number] = landing_hit;
        } else if (COUNTS_FLUX && landing_hit.footprints != 0) {
            count_no_room_on_meshes(landing, landing_hit);
        }
    }
}
