// plan chains: refines each lattice as far as its share of the light asks for.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) readonly buffer Lattices { ChainLattice lattices[]; };
PILOT_RAYS(1)
layout(std430, binding = 2) buffer Refined { ChainLattice refined[]; };
layout(std430, binding = 3) buffer Waves { uint waves[]; }; // see scan_chains.comp
#include "chain_push.glsl"
// Whether a medium disperses light.
layout(constant_id = ID_DISPERSES) const bool DISPERSES = false;
#include "dispatch_arguments.glsl"

// A lattice with all its refinements, all rays of which land, has the error to aim for in its own light. The error falls with the
// root of the number of rays that land. It adds at most this share of the error to the light of its receivers.
const float MAX_ADDED = 0.5;
// A receiver with less than this share of all light is judged as if it had this share.
const float DIM_RECEIVER = 0.01;
// Number of refinements of a lattice without chains.
const uint NONE = 0xffffffffu;

// The light that lands on each receiver, W. Receivers whose numbers are SPLAT_GROUP apart count as one.
shared float landed[SPLAT_GROUP];
// Number of rays that land.
shared float landings_on[SPLAT_GROUP];
// What each thread found of them for one receiver.
shared vec2 found[SPLAT_GROUP];

// How often a lattice is refined.
uint refinements_of(ChainLattice lattice, float all, float landed_rays) {
    float share = 0.0;
    float landings = 0.0;
    bool chains = false;
    uint rays = lattice.columns * lattice.rows;
    for (uint i = 0; i < rays; i++) {
        PilotRay ray = pilot_ray_at(lattice.first + i);
        if (ray.interfaces < 2) continue;
        chains = true;
        if (ray.flux == 0.0) continue;
        share += ray.flux / max(max(landed[ray.receiver % SPLAT_GROUP], DIM_RECEIVER * all), 1e-30);
        landings += 1.0;
    }
    // The light of a single surface is part of the balance of flux.
    if (COUNTS_FLUX && !chains) return 0;
    if (!chains) return NONE;
    if (landings == 0.0) {
        // Up to about one more ray may land.
        landings = 0.5;
        share = landings / max(landed_rays, 1.0);
    }
    float needed = exp2(2.0 * float(lattice.refinements)) * float(rays) * min(share * share / (MAX_ADDED * MAX_ADDED), 1.0);
    return uint(clamp(ceil(0.5 * log2(needed / landings)), 0.0, float(lattice.refinements)));
}

// Bands of the spectrum that the rays of a lattice carry one each, so that what lands is dispersed by at most this many standard
// deviations of the footprint within a band: over a band, places are linear in the index of refraction.
const float MAX_DISPERSED = 12.0;

uint bands_of(ChainLattice lattice) {
    float dispersed = 0.0;
    for (uint i = 0; i < lattice.columns * lattice.rows; i++) dispersed = max(dispersed, pilot_ray_at(lattice.first + i).dispersed);
    return uint(clamp(ceil(dispersed / MAX_DISPERSED), 1.0, float(MAX_BANDS)));
}

// Number of rays where each lattice is refined `fewer` times less.
uint ray_count(uint fewer) {
    float count = 0.0;
    for (uint i = 0; i < push.lattice_count; i++) {
        if (refined[i].refinements == NONE) continue;
        count += float(refined[i].bands) * exp2(2.0 * float(max(int(refined[i].refinements) - int(fewer), 0))) * float(lattices[i].columns * lattices[i].rows);
    }
    return uint(min(count, 4e9));
}

// One workgroup.
void main() {
    uint own = gl_LocalInvocationIndex;
    landed[own] = landings_on[own] = 0.0;
    // All threads share the rays: lavapipe ends a shader's loops after 65535 iterations in all, without a message.
    for (uint receiver = 0; receiver < min(push.receiver_count + push.mesh_count, SPLAT_GROUP); receiver++) {
        vec2 sum = vec2(0.0);
        for (uint i = own; i < push.pilot_count; i += SPLAT_GROUP) {
            PilotRay ray = pilot_ray_at(i);
            if (ray.flux != 0.0 && ray.receiver % SPLAT_GROUP == receiver) sum += vec2(ray.flux, 1.0);
        }
        found[own] = sum;
        barrier();
        if (own == receiver) {
            for (uint i = 0; i < SPLAT_GROUP; i++) {
                landed[own] += found[i].x;
                landings_on[own] += found[i].y;
            }
        }
        barrier();
    }
    float all = 0.0;
    float landed_rays = 0.0;
    for (uint i = 0; i < SPLAT_GROUP; i++) {
        all += landed[i];
        landed_rays += landings_on[i];
    }
    for (uint i = own; i < push.lattice_count; i += SPLAT_GROUP) {
        ChainLattice lattice = lattices[i];
        lattice.refinements = refinements_of(lattice, all, landed_rays);
        lattice.bands = 1;
        if (DISPERSES) lattice.bands = bands_of(lattice);
        refined[i] = lattice;
    }
    memoryBarrierBuffer();
    barrier();
    if (own != 0) return;
    uint fewer = 0;
    while (fewer < 16 && ray_count(fewer) > push.ray_capacity) fewer++;
    uint first = 0;
    uint bands = 1;
    if (DISPERSES) bands = MAX_BANDS;
    // Bands come after the first of every lattice, so that none is written before it is read.
    for (uint band = 0; band < bands; band++) {
        for (uint i = 0; i < push.lattice_count; i++) {
            ChainLattice lattice = refined[i];
            if (band == 0) {
                uint shift = uint(max(int(lattice.refinements) - int(fewer), 0));
                lattice.columns <<= shift;
                lattice.rows <<= shift;
                lattice.edge_u *= exp2(-float(shift));
                lattice.edge_v *= exp2(-float(shift));
                if (lattice.refinements == NONE) lattice.columns = lattice.rows = 0;
            }
            if (band >= lattice.bands) lattice.columns = lattice.rows = 0;
            lattice.band = band;
            lattice.first = first;
            first += lattice.columns * lattice.rows;
            refined[band * push.lattice_count + i] = lattice;
        }
    }
    WRITE_DISPATCH_OF(waves, 0, first)
    waves[UNITS_WORD] = first;
    waves[LANDINGS_WORD] = 0;
    waves[FOOTPRINTS_WORD] = 0;
    waves[LOST_PATHS_WORD] = 0;
}
