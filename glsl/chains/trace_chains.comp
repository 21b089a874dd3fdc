// trace chains: follows the rays of a wave of chains to where they land or meet an interface, and counts the lobes to follow and the
// footprints of each on planar receivers, and whether it reaches a mesh receiver.
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
layout(std430, binding = 6) readonly buffer Lattices { ChainLattice lattices[]; };
CHAIN_PATHS(7)
layout(std430, binding = 8) writeonly buffer Hits { ChainHit hits[]; };
layout(std430, binding = 9) writeonly buffer Numbers { uvec2 numbers[]; }; // lobes, footprints
layout(std430, binding = 10) readonly buffer Waves { uint waves[]; };
layout(std430, binding = 11) writeonly buffer Traced { ChainPath traced[]; };  // the same paths, where they are at their ends
layout(std430, binding = 12) readonly buffer Spectrum { vec4 weights_below[]; };
layout(std430, binding = 13) buffer FluxSums { uint flux_sums[]; };
layout(std430, binding = 14) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 15) readonly buffer AtlasNodes { AtlasNode atlas_nodes[]; };
layout(std430, binding = 16) writeonly buffer LandingNumbers { uvec2 landing_numbers[]; }; // 1: reaches a mesh receiver; 0
layout(std430, binding = 17) readonly buffer RayNumbers { uvec2 ray_numbers[]; }; // per cell of the lattices, see blocks.glsl
layout(std430, binding = 18) readonly buffer RaySums { uvec2 ray_sums[]; };
layout(std430, binding = 19) readonly buffer Cells { uint ray_cells[]; };         // see ray_cells.glsl
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
#include "kernel.glsl"
#include "chain_ray.glsl"
#include "light_axes.glsl"
#include "chain.glsl"
#include "lattice_ray.glsl"
#include "ray_cells.glsl"
#include "chain_changes.glsl"
#include "spectrum.glsl"
#include "chain_flux.glsl"
#include "light_beam.glsl"
#include "chain_landing.glsl"

#define BLOCK_RAYS(i) ray_sums[i].x
#define FIRST_RAY(i) ray_numbers[i].x

// Ray number `ray` of the lattices.
ChainPath ray_of_lattices(uint ray) {
    SEARCH(block, 0, (push.pilot_count + SPLAT_GROUP - 1) / SPLAT_GROUP, ray, BLOCK_RAYS)
    ray -= ray_sums[block].x;
    uint first = block * SPLAT_GROUP;
    SEARCH(cell, first, min(SPLAT_GROUP, push.pilot_count - first), ray, FIRST_RAY)
    ray -= ray_numbers[cell].x;
    LATTICE_OF(number, cell)
    ChainLattice lattice = lattices[number];
    uint halvings = halvings_of_cell(ray_cells[cell]);
    uint bands = bands_of_cell(ray_cells[cell]);
    uint band = ray >> halvings;
    uint part = ray & (1u << halvings) - 1u;
    uvec2 halved = sides_halved(halvings);
    uvec2 place = column_and_row(lattice, cell - lattice.first) << halved;
    place += uvec2(part & (1u << halved.x) - 1u, part >> halved.x);
    uint level = min(uint(min(findLSB(place.x | 1u << MAX_LATTICE_LEVEL), findLSB(place.y | 1u << MAX_LATTICE_LEVEL))), MAX_LATTICE_LEVEL);
    uint light_halved = light_halvings_of_cell(ray_cells[cell]);
    uint piece = piece_number(place, light_halved);
    ChainPath path = ray_at(lattice, shifted(lattice, vec2(place) + WITHIN_CELL, halved), halved, light_piece(piece, light_halved));
    path.counts = level << 16 | light_halved << 18 | piece << 20 | band << 24 | bands << 28;
    return path;
}

void main() {
    uint index = thread_index();
    if (index >= waves[UNITS_WORD]) return;
    ChainPath path;
    if (push.is_first != 0) path = ray_of_lattices(index); else path = path_at(index);
    trace_band(path);
    ChainHit hit;
    for (;;) {
        hit = hit_of(path);
        Interaction at;
        Lobe lobes[2];
        if (interfaces_of(path) < push.max_interfaces && interact(path, hit, at)) {
            lobes_of(path, at, lobes);
            hit.lobes = uint(lobes[0].is_followed) + uint(lobes[1].is_followed);
            if (COUNTS_FLUX) {
                count_surface(path, at);
                count_lobes(path, at, lobes);
            }
        } else if (COUNTS_FLUX) {
            count_end(path, hit);
        }
        if (is_of_chains(path)) {
            for (uint receiver = 0; receiver < push.receiver_count; receiver++) {
                Landing landing;
                if (land(path, hit, planar_receiver_at(receiver), receiver, landing)) hit.footprints += parts_of(landing);
            }
            if (HAS_ATLAS && reaches_mesh(path, hit)) hit.footprints |= ON_MESHES;
        }
        if (hit.footprints > 0 || hit.lobes != 1 || at.eta > 0.0) break;
        path = next_path(path, hit, at, transfer_to(path, hit, at), lobes[0], false);
    }
    numbers[index] = uvec2(hit.lobes, hit.footprints & ~ON_MESHES);
    if (HAS_ATLAS) landing_numbers[index] = uvec2(hit.footprints / ON_MESHES, 0);
    hits[index] = hit;
    if (hit.lobes + hit.footprints > 0) traced[index] = path;
}
