// overlay patch: the patches of facets, as the frame numbered them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)
FACETS(1)
layout(std430, binding = 2) readonly buffer Patches { FacetPatches facet_patches[]; };
layout(std430, binding = 3) readonly buffer PatchSums { uvec2 patch_sums[]; }; // see blocks.glsl: patches, patch corners
layout(std430, binding = 4) readonly buffer PatchNumbers { uvec2 patch_numbers[]; };
layout(std430, binding = 5) readonly buffer Totals { uint totals[]; };
layout(std430, binding = 6) readonly buffer PatchSplats { uint patch_splats[]; }; // per patch and target: see patch_splats.glsl
layout(location = 0) out vec3 inside;       // barycentric coordinates
layout(location = 1) out flat vec4 color;

#include "overlay.glsl"
#include "merged.glsl"
#include "triangle_lattice.glsl"
#include "patch_splats.glsl"
#include "search.glsl"
#include "find_patch.glsl"

// Patches that light a receiver; those among them that rays divide, since shadows cross them; and dark ones.
const vec4 LIT = vec4(0.1, 0.9, 1.0, 0.9);
const vec4 MIXED = vec4(1.0, 0.45, 0.0, 1.0);
const vec4 DARK = vec4(0.35, 0.35, 0.4, 0.5);

void main() {
    uint corner = gl_VertexIndex % 3;
    uint total = totals[UNITS_WORD];
    uint index = min(gl_VertexIndex / 3, max(total, 1u) - 1u);
    PatchPlace place = find_patch(index);
    Cell cell = cell_of(facet_cell(place.facet), place.index, place.division);
    vec2 st = place_in(cell, vec2(corner == 1, corner == 2));
    Triangle triangle = triangle_at(place.facet.triangle);
    inside = vec3(corner == 0, corner == 1, corner == 2);
    color = DARK;
    uint count = push.lobes * push.receiver_count;
    for (uint target = 0; target < count; target++) {
        uint packed = patch_splats[index * count + target];
        if (packed == 0) continue;
        if (is_mixed_of(packed)) color = MIXED;
        else if (color == DARK) color = LIT;
    }
    vec3 x = triangle.position + st.x * triangle.edge1 + st.y * triangle.edge2 + bulge_at(bulges_of(triangle), st);
    gl_Position = gl_VertexIndex / 3 < total ? seen_over(x) : NOWHERE;
}
