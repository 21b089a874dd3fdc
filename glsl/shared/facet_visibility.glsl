// The visibility of patch corners: two bits for each target. The corners of facets come first, light by light, then the
// lattices of the facets that are divided. The including shader declares the buffer `visibility`.

const uint UNKNOWN = 0; // the corner sends no light into the receiver's rectangle
const uint BLOCKED = 1;
const uint LIT = 2;
// Mark of a facet's corner that rays are needed for.
const uint NEEDED = 0xffffffffu;

// Whether some target of a word is known to be lit or blocked.
bool is_known(uint word) {
    return word != 0 && (word & 0x55555555u) == 0;
}

// Words of 16 targets for each corner.
uint words_of_targets() {
    return (push.lobes * push.receiver_count + 15) / 16;
}
