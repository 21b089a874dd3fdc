// facet_error: estimates the error of a receiver, and the number of patches, for every level of patch shares.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
FACETS(0)
FACET_IMAGES(1)
layout(std430, binding = 2) readonly buffer Shares { ReceiverShare shares[]; };
layout(std430, binding = 3) readonly buffer Visibility { uint visibility[]; };
// Per block of pairs, receiver and level: errors of images, of shadows, of profiles with PIECES[level] pieces of the light's disc, and patches
// beyond one for each pair.
layout(std430, binding = 4) writeonly buffer Errors { vec4 errors[]; };
#include "facet_push.glsl"
#include "error_model.glsl"
#include "outline_error.glsl"
#include "facet_visibility.glsl"
#include "blocks.glsl"

// Whether the light of one of the lobes reaches a receiver from some corners of a facet and is blocked at others.
bool is_mixed(Facet facet, uint pair, uint receiver) {
    bool found = false;
    for (uint lobe = 0; lobe < push.lobes; lobe++) {
        uvec3 states = states_at_corners(facet, pair / push.facet_count, receiver * push.lobes + lobe);
        found = found || any(equal(states, uvec3(BLOCKED))) && any(equal(states, uvec3(LIT)));
    }
    return found;
}

void main() {
    uint block = thread_index() / push.receiver_count;
    uint receiver = thread_index() % push.receiver_count;
    uint pairs = push.facet_count * push.light_count;
    uint end = min((block + 1) * SPLAT_GROUP, pairs);
    if (block * SPLAT_GROUP >= pairs) return;
    float flux = shares[receiver].flux;
    vec4 sums[SHARE_LEVELS];
    for (uint level = 0; level < SHARE_LEVELS; level++) sums[level] = vec4(0.0);
    for (uint pair = block * SPLAT_GROUP; pair < end; pair++) {
        // lavapipe runs the code of a branch that no thread takes, but not the rest of a loop that all have left.
        while (pair < end && facet_image_at(pair * push.receiver_count + receiver).flux <= 0.0) pair++;
        if (pair >= end) break;
        FacetImage image = facet_image_at(pair * push.receiver_count + receiver);
        float share = image.flux / flux;
        vec2 first = unpackHalf2x16(image.deviation_longest);
        vec2 second = unpackHalf2x16(image.height_blur);
        float blur = max(second.y, 1e-3);
        vec2 outline = unpackHalf2x16(image.outline);
        float of_profile = profile_error(blur);
        for (uint level = 0; level < PIECE_LEVELS; level++) sums[level].z += share * of_profile;
        // A loop, which lavapipe leaves out where no facet of a few shows its outline.
        for (uint level = 0; level < PIECE_LEVELS && outline.y > 0.0; level++) {
            uint pieces = needs_pieces(outline, blur, push.error) ? PIECES[level] : 1;
            sums[level].z += share * max(outline_error(outline, blur, pieces) - of_profile, 0.0);
        }
        Facet facet = facet_at(push.first_facet + pair % push.facet_count);
        float mixed = push.can_occlude != 0 && is_mixed(facet, pair, receiver) ? 1.0 : 0.0;
        for (uint level = 0; level < SHARE_LEVELS; level++) {
            float patch_share = FIRST_SHARE / float(1 << level);
            float parts = facet_division(share, patch_share);
            float deviation = deviation_of_part(first.x, parts, facet.along);
            float longest = first.y / parts;
            float height = second.x / parts;
            float of_patch = share / (parts * parts);
            float n = image_division(of_patch, deviation, height, blur, patch_share);
            // The edge of a shadow crosses about this number of patches.
            float crossed = (2.0 * parts - 1.0) * mixed;
            float finer = max(n, mixed_division(of_patch, longest, blur, outline.y, patch_share));
            sums[level] += vec4(parts * parts * image_error(of_patch, deviation, longest, blur, n),
                crossed * shadow_error(of_patch, longest, blur, outline.y, finer), 0.0, parts * parts - 1.0);
        }
    }
    for (uint level = 0; level < SHARE_LEVELS; level++) errors[(block * push.receiver_count + receiver) * SHARE_LEVELS + level] = sums[level];
}
