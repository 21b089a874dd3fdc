// Finds the facet of a patch. The including shader declares the buffers `facets`, `facet_patches`, `patch_numbers`
// and `patch_sums`.

struct PatchPlace {
    Facet facet;
    uint pair;
    uint light_index;
    uint index;        // among the patches of the facet
    uint division;
    uint first_point;  // of the facet's lattice in `visibility`
    uint targets;
};

#define BLOCK_PATCHES(i) patch_sums[i].x
#define FIRST_PATCH(i) patch_numbers[i].x

PatchPlace find_patch(uint patch_index) {
    uint pairs = push.facet_count * push.light_count;
    SEARCH(block, 0, (pairs + SPLAT_GROUP - 1) / SPLAT_GROUP, patch_index, BLOCK_PATCHES)
    uint local = patch_index - patch_sums[block].x;
    uint first = block * SPLAT_GROUP;
    SEARCH(pair, first, min(SPLAT_GROUP, pairs - first), local, FIRST_PATCH)
    FacetPatches patches = facet_patches[pair];
    return PatchPlace(facet_at(push.first_facet + pair % push.facet_count), pair, pair / push.facet_count, local - patch_numbers[pair].x, patches.division,
        push.corner_count * push.light_count + patch_sums[block].y + patch_numbers[pair].y, patches.targets);
}
