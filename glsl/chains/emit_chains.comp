// emit chains: writes the lobes that leave the surfaces of a wave as the next wave, and the footprints of what lands on planar receivers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
OBJECTS(2)
LIGHTS(3)
PLANAR_RECEIVERS(4)
CHAIN_PATHS(6)
CHAIN_HITS(7)
layout(std430, binding = 8) readonly buffer Numbers { uvec2 numbers[]; };      // prefix sums
layout(std430, binding = 9) readonly buffer BlockSums { uvec2 block_sums[]; };
layout(std430, binding = 10) readonly buffer Waves { uint waves[]; };
layout(std430, binding = 11) writeonly buffer NextPaths { ChainPath next_paths[]; };
layout(std430, binding = 12) writeonly buffer Footprints { ChainFootprint footprints[]; };
layout(std430, binding = 13) buffer Coarse { uint coarse[]; };
layout(std430, binding = 14) readonly buffer Profiles { Profile profiles[]; };
layout(std430, binding = 15) readonly buffer Spectrum { vec4 weights_below[]; };
layout(std430, binding = 16) buffer FluxSums { uint flux_sums[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "light_part.glsl"
#include "light_piece.glsl"
#include "media.glsl"
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

void main() {
    uint index = thread_index();
    if (index >= waves[UNITS_WORD]) return;
    ChainHit hit = hit_at(index);
    hit.footprints &= ~ON_MESHES;
    if (hit.lobes + hit.footprints == 0) return;
    ChainPath path = path_at(index);
    trace_band(path);
    uvec2 place = numbers[index] + block_sums[index / SPLAT_GROUP];
    place.y += waves[FOOTPRINTS_WORD];
    uint last = min(place.y + hit.footprints, push.splat_capacity);

    Interaction at;
    if (hit.lobes > 0 && interact(path, hit, at)) {
        Lobe lobes[2];
        lobes_of(path, at, lobes);
        Transfer transfer = transfer_to(path, hit, at);
        for (int i = 0; i < 2; i++) {
            if (!lobes[i].is_followed) continue;
            if (place.x >= push.path_capacity) {
                if (COUNTS_FLUX) count_flux(FLUX_CUT_ROOM, colour_of(path) * lobes[i].flux);
                continue;
            }
            next_paths[place.x++] = next_path(path, hit, at, transfer, lobes[i], i == 1);
        }
    }
    if (hit.footprints > 0) {
        for (uint receiver = 0; receiver < push.receiver_count; receiver++) {
            PlanarReceiver planar = planar_receiver_at(receiver);
            Landing landing;
            // Light without room is counted, too.
            bool is_needed = place.y < last || COUNTS_FLUX;
            if (!is_needed || !land(path, hit, planar, receiver, landing)) continue;
            uint parts = parts_of(landing);
            uint part = 0;
            for (; part < parts && place.y < last; part++) {
                Landing of_part = landing;
                vec3 flux = flux_after(path, landing.distance_);
                choose_part(of_part, flux, part, parts);
                footprints[place.y++] = footprint_of(of_part, flux, planar, receiver);
            }
            if (COUNTS_FLUX && part < parts) count_no_room(path, hit, receiver, part, parts);
        }
    }
    // Rounding may have made more footprints when they were counted. Those that are left have no extent.
    for (; place.y < last; place.y++) footprints[place.y] = no_footprint();
}
