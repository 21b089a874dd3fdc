// The triangles of a patch on one receiver, packed: number along an edge of each part | number of parts << 8 | whether
// rays decide for each triangle << 10 | whether the patch is clipped << 11.

uint pack_splats(uint along, uint parts, bool is_mixed, bool is_clipped) {
    return along == 0 ? 0 : along | parts << 8 | (is_mixed ? 1u << 10 : 0u) | (is_clipped ? 1u << 11 : 0u);
}

uint along_of(uint packed) {
    return packed & 0xffu;
}

bool is_mixed_of(uint packed) {
    return (packed >> 10 & 1u) != 0;
}

bool is_clipped_of(uint packed) {
    return (packed >> 11 & 1u) != 0;
}

uint splats_of(uint packed) {
    return along_of(packed) * along_of(packed) * (packed >> 8 & 3u);
}
