// The triangles of a patch on one receiver, packed: number along an edge of each part | number of parts << PARTS_SHIFT |
// whether rays decide for each triangle << MIXED_SHIFT | whether the patch is clipped << CLIPPED_SHIFT | number of pieces of the
// light's disc << PIECES_SHIFT.

uint pack_splats(uint along, uint parts, bool is_mixed, bool is_clipped, uint pieces) {
    uint flags = (is_mixed ? 1u << MIXED_SHIFT : 0u) | (is_clipped ? 1u << CLIPPED_SHIFT : 0u);
    return along == 0 ? 0 : along | parts << PARTS_SHIFT | flags | pieces << PIECES_SHIFT;
}

uint along_of(uint packed) {
    return packed & ((1u << PARTS_SHIFT) - 1u);
}

bool is_mixed_of(uint packed) {
    return (packed >> MIXED_SHIFT & 1u) != 0;
}

bool is_clipped_of(uint packed) {
    return (packed >> CLIPPED_SHIFT & 1u) != 0;
}

uint pieces_of(uint packed) {
    return packed >> PIECES_SHIFT;
}

uint splats_of(uint packed) {
    return along_of(packed) * along_of(packed) * (packed >> PARTS_SHIFT & 3u) * pieces_of(packed);
}
