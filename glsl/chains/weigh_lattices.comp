// weigh lattices: adds up what the pilot rays of each lattice found, and marks its cells.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) readonly buffer Lattices { ChainLattice lattices[]; };
PILOT_RAYS(1)
layout(std430, binding = 2) writeonly buffer Pilots { LatticePilot lattice_pilots[]; };
layout(std430, binding = 3) writeonly buffer Fluxes { vec4 lattice_fluxes[]; }; // per lattice and receiver: W and rays that land; W of chains; 0
layout(std430, binding = 4) writeonly buffer Cells { uint ray_cells[]; };       // see ray_cells.glsl
#include "chain_push.glsl"
#include "ray_cells.glsl"

shared vec4 found[SPLAT_GROUP];
shared LatticePilot pilots[SPLAT_GROUP];

// What the ray of a cell and those of the cells around it found.
uint kind_of(ChainLattice lattice, uint cell) {
    ivec2 at = ivec2(column_and_row(lattice, cell));
    ivec2 low = max(at - 1, 0);
    ivec2 high = min(at + 1, ivec2(lattice.columns, lattice.rows) - 1);
    uint kind = NO_CHAINS;
    for (int y = low.y; y <= high.y; y++) {
        for (int x = low.x; x <= high.x; x++) {
            PilotRay ray = pilot_ray_at(lattice.first + y * lattice.columns + x);
            if (is_chain(ray)) kind = max(kind, ray.flux > 0.0 ? NEAR_LANDINGS : NEAR_CHAINS);
        }
    }
    return kind;
}

// One workgroup a lattice.
void main() {
    uint own = gl_LocalInvocationIndex;
    ChainLattice lattice = lattices[gl_WorkGroupID.x];
    uint cells = lattice.columns * lattice.rows;
    LatticePilot pilot = LatticePilot(0, 0, 0, 0, vec2(0.0), 0.0, 0.0, 0.0, 0.0);
    for (uint cell = own; cell < cells; cell += SPLAT_GROUP) {
        uint kind = kind_of(lattice, cell);
        ray_cells[lattice.first + cell] = kind;
        if (kind == NEAR_LANDINGS) pilot.near_landings++;
        if (kind == NEAR_CHAINS) pilot.near_chains++;
        PilotRay ray = pilot_ray_at(lattice.first + cell);
        pilot.dispersed = max(pilot.dispersed, ray.dispersed);
        if (!is_chain(ray)) continue;
        pilot.chains++;
        if (ray.flux == 0.0) continue;
        pilot.landings++;
        pilot.flux += ray.flux;
        pilot.incoherent += ray.flux * incoherence_of_pilot(ray);
        pilot.parts += ray.dispersed;
    }
    pilots[own] = pilot;
    uint receivers = push.receiver_count + push.mesh_count;
    for (uint receiver = 0; receiver < receivers; receiver++) {
        vec4 sum = vec4(0.0);
        for (uint cell = own; cell < cells; cell += SPLAT_GROUP) {
            PilotRay ray = pilot_ray_at(lattice.first + cell);
            if (ray.flux != 0.0 && ray.receiver == receiver) sum.xyz += vec3(ray.flux, 1.0, is_chain(ray) ? ray.flux : 0.0);
        }
        found[own] = sum;
        barrier();
        if (own == 0) {
            for (uint i = 1; i < SPLAT_GROUP; i++) sum += found[i];
            lattice_fluxes[gl_WorkGroupID.x * receivers + receiver] = sum;
        }
        barrier();
    }
    if (own != 0) return;
    for (uint i = 1; i < SPLAT_GROUP; i++) {
        pilot.chains += pilots[i].chains;
        pilot.near_landings += pilots[i].near_landings;
        pilot.near_chains += pilots[i].near_chains;
        pilot.landings += pilots[i].landings;
        pilot.flux += pilots[i].flux;
        pilot.incoherent += pilots[i].incoherent;
        pilot.parts += pilots[i].parts;
        pilot.dispersed = max(pilot.dispersed, pilots[i].dispersed);
    }
    lattice_pilots[gl_WorkGroupID.x] = pilot;
}
