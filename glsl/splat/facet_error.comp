// facet_error: estimates the error of a receiver, and the number of patches, for every level of patch shares.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
FACETS(0)
FACET_IMAGES(1)
layout(std430, binding = 2) readonly buffer Shares { ReceiverShare shares[]; };
// Per block of pairs, receiver and level: errors of images, of shadows, of profiles with PIECES[level] pieces of the light's disc, and patches
// beyond one for each pair.
layout(std430, binding = 3) writeonly buffer Errors { vec4 errors[]; };
#include "facet_push.glsl"
#include "error_model.glsl"
#include "outline_error.glsl"
#include "blocks.glsl"

void main() {
    // A thread for every level: neighbouring threads read the same facets, and drivers do not unroll a loop over the levels.
    uint level = thread_index() % SHARE_LEVELS;
    uint block_and_receiver = thread_index() / SHARE_LEVELS;
    uint receiver = block_and_receiver % push.receiver_count;
    uint first = block_and_receiver / push.receiver_count * SPLAT_GROUP;
    uint pairs = push.facet_count * push.light_count;
    uint end = min(first + SPLAT_GROUP, pairs);
    if (first >= pairs) return;
    float flux = shares[receiver].flux;
    float patch_share = FIRST_SHARE / float(1u << level);
    uint pieces_of_level = PIECES[min(level, PIECE_LEVELS - 1)];
    vec4 sum = vec4(0.0);
    for (uint pair = first; pair < end; pair++) {
        // lavapipe runs the code of a branch that no thread takes, but not the rest of a loop that all have left.
        while (pair < end && facet_image_at(pair * push.receiver_count + receiver).flux <= 0.0) pair++;
        if (pair >= end) break;
        FacetImage image = facet_image_at(pair * push.receiver_count + receiver);
        float share = image.flux / flux;
        vec2 deviation_longest = unpackHalf2x16(image.deviation_longest & ~HAS_SHADOW_EDGE);
        vec2 height_blur = unpackHalf2x16(image.height_blur);
        float blur = max(height_blur.y, 1e-3);
        vec2 outline = unpackHalf2x16(image.outline);
        float of_profile = profile_error(blur);
        sum.z += share * of_profile;
        // A loop of one turn, which lavapipe leaves out where no facet of a few shows its outline.
        for (bool shows = outline.y > 0.0; shows; shows = false) {
            uint pieces = needs_pieces(outline, blur, push.error) ? pieces_of_level : 1;
            sum.z += share * max(outline_error(outline, blur, pieces) - of_profile, 0.0);
        }
        Facet facet = facet_at(push.first_facet + pair % push.facet_count);
        float mixed = (image.deviation_longest & HAS_SHADOW_EDGE) != 0 ? 1.0 : 0.0;
        float parts = facet_division(share, patch_share);
        float deviation = deviation_of_part(deviation_longest.x, parts, facet.along);
        float longest = deviation_longest.y / parts;
        float height = height_blur.x / parts;
        float of_patch = share / (parts * parts);
        float n = image_division(of_patch, deviation, height, blur, patch_share);
        // The edge of a shadow crosses about this number of patches.
        float crossed = (2.0 * parts - 1.0) * mixed;
        float finer = max(n, mixed_division(of_patch, longest, blur, outline.y, patch_share));
        sum += vec4(parts * parts * image_error(of_patch, deviation, longest, blur, n),
            crossed * shadow_error(of_patch, longest, blur, outline.y, finer), 0.0, parts * parts - 1.0);
    }
    // Levels beyond PIECE_LEVELS have no number of pieces of their own.
    if (level >= PIECE_LEVELS) sum.z = 0.0;
    errors[thread_index()] = sum;
}
