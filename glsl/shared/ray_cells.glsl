// The cells of the lattices, and the rays of each. A cell has one pilot ray. It is then halved across one side and the other by turns, and
// its parts have a ray for each band of the spectrum. How often depends on what the pilot rays of the cell and of the eight around it found.
// The including shader includes chain_push.glsl.

// Finds the number of the lattice of a cell. A shader that uses it declares `lattices` and includes blocks.glsl.
#define FIRST_CELL(i) lattices[i].first
#define LATTICE_OF(found, cell) SEARCH(found, 0, push.lattice_count, cell, FIRST_CELL)

// Column and row of a cell within its lattice; `cell` counts from the lattice's first.
uvec2 column_and_row(ChainLattice lattice, uint cell) {
    return uvec2(cell % lattice.columns, cell / lattice.columns);
}

// What is in a cell or around it, while the cells are counted.
const uint NO_CHAINS = 0;
const uint NEAR_CHAINS = 1;   // light that meets two surfaces or more, but lands nowhere
const uint NEAR_LANDINGS = 2; // such light that lands

// Halvings of a cell of this kind.
uint cell_halvings(LatticePlan plan, uint kind) {
    uint less[3] = uint[](plan.less_elsewhere, plan.less_near_chains, 0);
    return plan.halvings - min(less[kind], plan.halvings);
}

// How often the sides of a light are halved, at most: rays have at most 16 pieces of it.
const uint MAX_LIGHT_HALVINGS = 2;

// Halvings of a lattice without chains.
const uint NO_RAYS = 0xffffffffu;

// How often the columns and the rows of a cell are halved.
uvec2 sides_halved(uint halvings) {
    return uvec2((halvings + 1) / 2, halvings / 2);
}

// A cell's halvings, and the bands of its lattice, in a word.
uint pack_cell(uint halvings, uint bands, uint halved) {
    return halvings | bands << 8 | halved << 16;
}

uint halvings_of_cell(uint word) {
    return word & 0xffu;
}

uint bands_of_cell(uint word) {
    return word >> 8 & 0xffu;
}

// How often the sides of the light are halved.
uint light_halvings_of_cell(uint word) {
    return word >> 16;
}

// In `PilotRay.interfaces`: the ray is one of chains.
const uint IS_CHAIN = 1u << 8;

// The number of surfaces that a pilot ray met, with IS_CHAIN, and how far its neighbours, and the rays of other directions of the light,
// disagree about where it lands, from 0 to 1.
uint pack_pilot(uint interfaces, vec2 incoherent) {
    uvec2 steps = uvec2(clamp(incoherent, 0.0, 1.0) * vec2(2047.0, 4095.0) + 0.5);
    return interfaces | steps.x << 9 | steps.y << 20;
}

vec2 incoherence_of_pilot(PilotRay ray) {
    return vec2(ray.interfaces >> 9 & 2047u, ray.interfaces >> 20) / vec2(2047.0, 4095.0);
}

bool is_chain(PilotRay ray) {
    return (ray.interfaces & IS_CHAIN) != 0;
}
