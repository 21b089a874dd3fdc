// The push constants of the passes from facets to triangles. A pair is light * facet_count + facet.

layout(push_constant) uniform FacetPush {
    uint facet_count;
    uint corner_count;
    uint light_count;
    uint receiver_count;
    uint lobes;          // 1: reflected light; 2: also refracted light
    uint can_occlude;    // 0: nothing can occlude light, so that no rays are traced
    uint division;       // 0: as many patches as their flux asks for; otherwise the number along an edge of each facet
    float error;         // relative L1 error to aim for; 0: patches have `patch_share`
    float patch_share;   // share of a receiver's flux that a patch has
    uint patch_budget;   // maximum number of patches for `error`, beyond one for each pair
    uint is_lattice;     // trace_corners: 0: the corners of facets; 1: the lattices
    uint first_splat;    // of this batch
    uint has_chains;     // 1: chains light receivers, too
    float merging_error; // cautious estimate of the error of merged triangles
    uint first_facet;    // of this frame's in the list of facets
    uint first_corner;   // of theirs in the list of corners
} push;

// A number of parts along an edge. Rounds up from 0.3 above a whole number on, which balances the errors of rounding.
float rounded(float parts, uint most) {
    return clamp(ceil(parts - 0.3), 1.0, float(most));
}
