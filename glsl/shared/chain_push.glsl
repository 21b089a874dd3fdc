layout(push_constant) uniform ChainPush {
    uint is_first;       // 1: the rays of the lattices
    uint lattice_count;
    uint pilot_count;    // of the rays of all lattices before their refinement
    uint receiver_count; // of planar receivers
    uint mesh_count;     // of mesh receivers
    uint max_interfaces;
    uint ray_capacity;   // of the rays of all lattices
    uint path_capacity;  // of a wave, and of landings on mesh receivers
    uint splat_capacity;
    uint mesh_splat_capacity;
    uint first_mesh_splat; // of a batch
    uint mesh_splat_batch; // number of mesh footprints of a batch
    float spread;        // variance of a kernel over the square of the lattice's cell
    float spectral_middle; // coordinate of the traced wavelength
    float flux_scale;    // units of the sums of flux in 1 W, a power of two; see chain_flux.glsl
    float error;         // relative L1 error to aim for; 0: the lattices' refinements are not exceeded
} push;
// Whether there are mesh receivers.
layout(constant_id = ID_HAS_ATLAS) const bool HAS_ATLAS = false;
// Whether the light is counted by where it ends.
layout(constant_id = ID_COUNTS_FLUX) const bool COUNTS_FLUX = false;
