// count rays: divides the cells of the lattices.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) readonly buffer Lattices { ChainLattice lattices[]; };
layout(std430, binding = 1) readonly buffer Plans { LatticePlan lattice_plans[]; };
layout(std430, binding = 2) buffer Cells { uint ray_cells[]; };             // see ray_cells.glsl
layout(std430, binding = 3) writeonly buffer Numbers { uvec2 ray_numbers[]; }; // rays, 0
PILOT_RAYS(4)
#include "chain_push.glsl"
#include "blocks.glsl"
#include "ray_cells.glsl"

// Whether light has one way at every surface.
layout(constant_id = ID_ONLY_MIRRORS) const bool ONLY_MIRRORS = false;

void main() {
    uint cell = thread_index();
    if (cell >= push.pilot_count) return;
    LATTICE_OF(lattice, cell)
    LatticePlan plan = lattice_plans[lattice];
    uint rays = 0;
    if (plan.halvings != NO_RAYS) {
        uint halvings = cell_halvings(plan, ray_cells[cell]);
        ray_cells[cell] = pack_cell(halvings, plan.bands, plan.light_halvings);
        rays = plan.bands << halvings;
        // The ray of an undivided cell is its pilot ray, which has shown whether it chains.
        bool is_known = false;
        if (ONLY_MIRRORS) is_known = halvings == 0 && plan.light_halvings == 0;
        if (COUNTS_FLUX) is_known = false;
        if (is_known && !is_chain(pilot_ray_at(cell))) rays = 0;
    }
    ray_numbers[cell] = uvec2(rays, 0);
}
