// plan chains: refines each lattice as far as its share of the light asks for.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Lattices { ChainLattice lattices[]; };
layout(std430, binding = 1) readonly buffer PilotShares { float pilot_shares[]; };
layout(std430, binding = 2) buffer Refined { ChainLattice refined[]; };
layout(std430, binding = 3) buffer Waves { uint waves[]; }; // see advance_chains.comp
#include "chain_push.glsl"
#include "dispatch_arguments.glsl"

// With all its refinements a lattice has the error to aim for in its own light. It adds at most half of that to the light of its
// receivers.
const float MAX_ADDED = 0.5;
// Of a lattice without chains.
const uint NONE = 0xffffffffu;

// How often a lattice is refined. The error of its light falls to a half with each refinement.
uint refinements_of(ChainLattice lattice) {
    float ratio = 0.0;
    for (uint i = 0; i < lattice.columns * lattice.rows; i++) ratio += pilot_shares[lattice.first + i];
    if (ratio == 0.0) return NONE;
    float spared = floor(log2(MAX_ADDED * (1.0 + ratio) / ratio));
    return lattice.refinements - uint(clamp(spared, 0.0, float(lattice.refinements)));
}

// Number of rays where each lattice is refined `fewer` times less.
uint ray_count(uint fewer) {
    float count = 0.0;
    for (uint i = 0; i < push.lattice_count; i++) {
        if (refined[i].refinements == NONE) continue;
        count += exp2(2.0 * float(max(int(refined[i].refinements) - int(fewer), 0))) * float(lattices[i].columns * lattices[i].rows);
    }
    return uint(min(count, 4e9));
}

// One workgroup.
void main() {
    for (uint i = gl_LocalInvocationIndex; i < push.lattice_count; i += SPLAT_GROUP) {
        ChainLattice lattice = lattices[i];
        lattice.refinements = refinements_of(lattice);
        refined[i] = lattice;
    }
    memoryBarrierBuffer();
    barrier();
    if (gl_LocalInvocationIndex != 0) return;
    uint fewer = 0;
    while (fewer < 16 && ray_count(fewer) > push.ray_capacity) fewer++;
    uint first = 0;
    for (uint i = 0; i < push.lattice_count; i++) {
        ChainLattice lattice = refined[i];
        if (lattice.refinements == NONE) {
            lattice.columns = lattice.rows = 0;
        } else {
            uint shift = uint(max(int(lattice.refinements) - int(fewer), 0));
            lattice.columns <<= shift;
            lattice.rows <<= shift;
            lattice.edge_u *= exp2(-float(shift));
            lattice.edge_v *= exp2(-float(shift));
        }
        lattice.first = first;
        first += lattice.columns * lattice.rows;
        refined[i] = lattice;
    }
    WRITE_DISPATCH_OF(waves, 0, first)
    waves[6] = first;
    waves[7] = 0;
    waves[8] = 0;
    WRITE_DRAW(waves, 9, 0)
}
