// patch_count: chooses the number of triangles that stand for the image of each patch on each receiver.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
OBJECTS(2)
LIGHTS(3)
PLANAR_RECEIVERS(4)
FACETS(5)
layout(std430, binding = 6) readonly buffer Patches { FacetPatches facet_patches[]; };
layout(std430, binding = 7) readonly buffer PatchSums { uvec2 patch_sums[]; }; // see blocks.glsl: patches, patch corners
layout(std430, binding = 8) readonly buffer Totals { uint totals[]; };
layout(std430, binding = 9) readonly buffer Shares { ReceiverShare shares[]; };
layout(std430, binding = 10) readonly buffer Visibility { uint visibility[]; };
layout(std430, binding = 11) readonly buffer PatchNumbers { uvec2 patch_numbers[]; };
layout(std430, binding = 12) writeonly buffer PatchSplats { uint patch_splats[]; }; // per patch and target: see patch_splats.glsl
layout(std430, binding = 13) writeonly buffer SplatNumbers { uvec2 splat_numbers[]; }; // per patch: triangles, whether lit
FACET_IMAGES(14)
#include "facet_push.glsl"

#include "light.glsl"
#include "optics.glsl"
#include "kernel.glsl"
#include "planar_receiver.glsl"
#include "facet.glsl"
#include "facet_image.glsl"
#include "facet_visibility.glsl"
#include "error_model.glsl"
#include "outline_error.glsl"
#include "patch_splats.glsl"
#include "blocks.glsl"
#include "find_patch.glsl"

// Visibility of a corner of a patch, at the place `at` of its facet's lattice, for a word of targets.
uint visibility_at(PatchPlace place, ivec2 at, uint word) {
    uint n = place.division;
    uint corner;
    if (at.x == n) corner = place.facet.corner1;
    else if (at.y == n) corner = place.facet.corner2;
    else if (at.x + at.y == 0) corner = place.facet.corner0;
    else return visibility[(place.first_point + lattice_point(uvec2(at), n)) * words_of_targets() + word];
    return visibility[(place.light_index * push.corner_count + corner) * words_of_targets() + word];
}

// Standard deviation of the disc's perspective up to which the disc is divided into pieces.
const float MAX_PERSPECTIVE = 0.15;

// Side of the blur, texels, from which on the disc is divided where light is blocked in a part of the patch.
const float MIXED_BLUR = 1.5;

// The triangles for the image on receiver `index`, so that the error of each patch is in proportion.
uint triangles_for(Surface surface, Cell cell, Light light, uint index, float eta, bool is_mixed, bool is_blocked, float exposed, uint pieces, bool is_straight) {
    PlanarReceiver receiver = planar_receiver_at(index);
    CellImage image = image_of(surface, cell, rays_of(surface, cell, light, eta), light, receiver);
    if (!image.is_lit || misses(image, receiver)) return 0;
    float patch_share = shares[index].patch_share;
    // The receiver's flux has no more of the image's than the part that falls on it, as far as corners are lit.
    float share = min(dot(image.flux, vec3(1.0 / 3.0)) / max(shares[index].flux, 1e-30), 1.0);
    float longest = longest_side(image);
    float height = height_of(image);
    float blur = blur_side(image);
    float n = image_division(share, is_straight ? 0.0 : deviation_of(image), height, blur, patch_share);
    // Rays from every triangle of a mixed patch.
    if (is_mixed && !is_blocked) n = max(n, mixed_division(share, longest, blur, exposed, patch_share));
    // Where perspective is strong, it is not affine over a piece.
    if (length(image.slant * image.of_light) > MAX_PERSPECTIVE) pieces = 1;
    // No patch takes more than its share of the capacity.
    n = max(min(n, floor(sqrt(MAX_TRIANGLES_PER_PATCH * share / (float(pieces) * patch_share)))), 1.0);
    if (BEAMS) n = 1.0;
    return pack_splats(uint(n), clipped_parts(image.margins), is_mixed, !all(greaterThanEqual(image.margins, vec3(0.0))), pieces);
}

void main() {
    uint patch_index = thread_index();
    if (patch_index >= totals[UNITS_WORD]) return;
    PatchPlace place = find_patch(patch_index);
    Light light = light_toward(place.light_index, place.facet.triangle);
    Surface surface = surface_toward(place.facet.triangle, light);
    ivec3 at = lattice_cell(place.index, place.division);
    Cell cell = cell_of(facet_cell(place.facet), place.index, place.division);
    bool is_straight = deviation_of_part(1.0, float(place.division), place.facet.along) == 0.0;
    uint count = push.lobes * push.receiver_count;
    for (uint target = 0; target < count; target++) patch_splats[patch_index * count + target] = 0;
    uint splats = 0;
    for (uint target = next_target(place.targets, 0, count); target < count; target = next_target(place.targets, target + 1, count)) {
        FacetImage of_facet = facet_image_at(place.pair * push.receiver_count + target / push.lobes);
        vec2 outline = unpackHalf2x16(of_facet.outline);
        float exposed = outline.y;
        bool is_mixed = false;
        bool is_blocked = false;
        if (BEAMS) {
            is_mixed = push.can_occlude != 0;
        } else if (push.can_occlude != 0) {
            uvec3 seen = uvec3(visibility_at(place, at.xy, target / 16),
                visibility_at(place, at.xy + ivec2(at.z, 0), target / 16),
                visibility_at(place, at.xy + ivec2(0, at.z), target / 16));
            uvec3 states = seen >> 2 * (target % 16) & 3u;
            // An undivided facet may be lit between its corners. Neighbours make up for what it lacks, but not where the surface bends.
            is_blocked = all(equal(states, uvec3(BLOCKED)));
            if (is_blocked && (place.division > 1 || exposed == 0.0)) continue;
            // Corners that send no light into the receiver say nothing about the rest of the patch.
            is_mixed = any(equal(states, uvec3(BLOCKED))) || !any(equal(states, uvec3(LIT)));
        }
        // Patches of a facet that are lit alike have the same pieces, so that they fit together.
        float blur = unpackHalf2x16(of_facet.height_blur).y;
        uint pieces = push.error > 0.0 && needs_pieces(outline, blur, push.error) ? shares[target / push.lobes].pieces : 1;
        // The lit part of the disc lands beside the middle of its image.
        if (is_mixed && push.error > 0.0 && blur > MIXED_BLUR) pieces = max(pieces, 4);
        if (is_blocked) pieces = 1; // rare light, for which one pair of rays has to do
        uint found = triangles_for(surface, cell, light, target / push.lobes, target % push.lobes == 0 ? 0.0 : surface.eta, is_mixed, is_blocked, exposed, pieces, is_straight);
        patch_splats[patch_index * count + target] = found;
        splats += splats_of(found);
    }
    splat_numbers[patch_index] = uvec2(splats, min(splats, 1));
}
