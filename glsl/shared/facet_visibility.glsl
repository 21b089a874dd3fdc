// The visibility of patch corners: two bits for each target, a lobe on a receiver. The corners of facets come first,
// light by light, then the lattices of the facets that are divided. The including shader declares the buffer
// `visibility`, where facet_flux.comp lists the targets that rays from a facet's corner are needed for.

const uint UNKNOWN = 0; // not traced: the corner sends no light into the receiver's rectangle
const uint BLOCKED = 1;
const uint LIT = 2;

// Targets that a facet may light are listed in a word: bit t for target t, the last bit for all from 31 on.
uint target_bit(uint target) {
    return 1u << min(target, 31u);
}

// The next of `count` targets that are listed, from `target` on.
uint next_target(uint targets, uint target, uint count) {
    uint left = target < 31 ? targets >> target << target : targets >> 31 << 31;
    if (left == 0) return count;
    uint next = uint(findLSB(left));
    return min(next == 31 ? max(target, 31u) : next, count);
}

// Words of 16 targets for each corner.
uint words_of_targets() {
    return (push.lobes * push.receiver_count + 15) / 16;
}

// States of a target at the three corners of a facet.
uvec3 states_at_corners(Facet facet, uint light_index, uint target) {
    uvec3 corners = light_index * push.corner_count + uvec3(facet.corner0, facet.corner1, facet.corner2);
    uvec3 at = corners * words_of_targets() + target / 16;
    return uvec3(visibility[at.x], visibility[at.y], visibility[at.z]) >> 2 * (target % 16) & 3u;
}
