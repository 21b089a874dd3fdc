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

// Halvings that a cell has less than one near landings. Few of the others hold light that lands, but some do: their rays are spread
// more widely, not left out, so that no light is lost.
const int FEWER[3] = int[](4, 2, 0);

uint cell_halvings(LatticePlan plan, uint kind) {
    // The balance of flux counts light that does not land, too. With a number of samples, and on meshes, where a landing costs more than
    // a ray, an even lattice has fewer wide landings.
    if (COUNTS_FLUX) return plan.halvings;
    if (HAS_ATLAS) return plan.halvings;
    if (push.error == 0.0) return plan.halvings;
    return uint(max(int(plan.halvings) - FEWER[kind], 0));
}

// Halvings of a lattice without chains.
const uint NO_RAYS = 0xffffffffu;

// How often the columns and the rows of a cell are halved.
uvec2 sides_halved(uint halvings) {
    return uvec2((halvings + 1) / 2, halvings / 2);
}

// A cell's halvings, and the bands of its lattice, in a word.
uint pack_cell(uint halvings, uint bands) {
    return halvings | bands << 8;
}

uint halvings_of_cell(uint word) {
    return word & 0xffu;
}

uint bands_of_cell(uint word) {
    return word >> 8;
}

// In `PilotRay.interfaces`: the ray is one of chains.
const uint IS_CHAIN = 1u << 15;

// The number of surfaces that a pilot ray met, with IS_CHAIN, and how far its neighbours disagree about where it lands, from 0 to 1.
uint pack_pilot(uint interfaces, float incoherent) {
    return interfaces | uint(clamp(incoherent, 0.0, 1.0) * 65535.0) << 16;
}

float incoherence_of_pilot(PilotRay ray) {
    return float(ray.interfaces >> 16) / 65535.0;
}

bool is_chain(PilotRay ray) {
    return (ray.interfaces & IS_CHAIN) != 0;
}
