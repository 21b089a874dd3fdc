layout(push_constant) uniform ChainPush {
    uint is_first;       // 1: the rays of the lattices
    uint lattice_count;
    uint ray_count;      // of the lattices
    uint receiver_count;
    uint max_interfaces;
    uint path_capacity;
    uint splat_capacity;
    float spread;        // variance of a kernel over the square of the lattice's cell
} push;
