// choose_share: chooses the fewest pieces of the light's disc for facets that show their outline, and the largest patch share with which a
// receiver's estimated error is at most the one to aim for.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
// Per block of pairs, receiver and level: errors of images, of shadows, of profiles with PIECES[level] pieces of the light's disc, and patches
// beyond one for each pair.
layout(std430, binding = 0) readonly buffer Errors { vec4 errors[]; };
layout(std430, binding = 1) buffer Shares { ReceiverShare shares[]; };
layout(std430, binding = 2) readonly buffer ChainErrors { vec2 chain_errors[]; }; // see plan_chains.comp
PLANAR_RECEIVERS(3)
#include "facet_push.glsl"
#include "error_model.glsl"
#include "outline_error.glsl"

// Factor by which facets are divided more finely where shadows of undivided ones leave at least this error.
const float MOST_HIDDEN = 4.0;
const float MANY_SHADOWS = 1.0 / 32.0;
// What large patches do not see is more than in proportion to their size: from 1 to 5 % patches are no larger than for 1 %, and beyond, where
// only the time matters, than for this part of the error.
const float COARSEST_ERROR = 0.01;
const float PART_OF_LARGE_ERROR = 0.2;

// Errors of a receiver are relative to its light, but to no less than this share of the light of all receivers or of the irradiance of the
// brightest, whichever is less: facets whose light grazes a receiver would otherwise take more time than the rest of the frame.
const float LEAST_LIGHT = 1e-3;

shared vec4 sums[SHARE_LEVELS];

// The receiver's light over what its errors are relative to.
float significance_of(uint receiver) {
    float total = 0.0;
    float brightest = 0.0;
    float flux = 0.0;
    float irradiance = 0.0;
    for (uint i = 0; i < push.receiver_count; i++) {
        PlanarReceiver of = planar_receiver_at(i);
        float own = shares[i].flux;
        float mean = own / length(cross(of.edge_u, of.edge_v));
        total += own;
        brightest = max(brightest, mean);
        flux = i == receiver ? own : flux;
        irradiance = i == receiver ? mean : irradiance;
    }
    if (!(total > 0.0)) return 1.0;
    return clamp(max(flux / total, irradiance / brightest) / LEAST_LIGHT, 0.0, 1.0);
}

// Error at a level that may lie between two whole ones. There is no estimate below the first.
float error_at(float level) {
    level = max(level, 0.0);
    uint low = min(uint(level), SHARE_LEVELS - 2);
    return exp2(mix(log2(estimated_error(sums[low].xyz)), log2(estimated_error(sums[low + 1].xyz)), level - float(low)));
}

// One workgroup a receiver, one thread a level.
void main() {
    uint receiver = gl_WorkGroupID.x;
    uint level = gl_LocalInvocationIndex;
    uint blocks = (push.facet_count * push.light_count + SPLAT_GROUP - 1) / SPLAT_GROUP;
    if (level < SHARE_LEVELS && push.error > 0.0) {
        vec4 sum = vec4(0.0);
        for (uint block = 0; block < blocks; block++) sum += errors[(block * push.receiver_count + receiver) * SHARE_LEVELS + level];
        sums[level] = sum;
    }
    barrier();
    if (level != 0) return;
    vec2 chains = vec2(0.0);
    if (push.has_chains != 0) chains = chain_errors[receiver];
    // Of chains and of merged triangles. Errors are relative to all light of the receiver, with that of chains.
    float significance = max(significance_of(receiver), 1e-6);
    float facet_share = max(1.0 - chains.y, 0.01) * significance;
    vec2 fixed_ = vec2(chains.x, facet_share * push.merging_error);
    float chosen = log2(significance * FIRST_SHARE / push.patch_share);
    bool is_limited = false;
    uint piece_level = 0;
    if (push.error > 0.0) {
        while (piece_level + 1 < PIECE_LEVELS && significance * sums[piece_level].z > OUTLINE_SHARE * push.error) piece_level++;
        float of_profiles = sums[piece_level].z;
        for (uint i = 0; i < SHARE_LEVELS; i++) sums[i].z = of_profiles;
        // Receivers share the budget.
        float budget = float(push.patch_budget) / float(push.receiver_count);
        float finest = 0.0;
        while (finest < float(SHARE_LEVELS - 1) && sums[uint(finest) + 1].w <= budget) finest += 1.0;
        // Errors of patches and of the others are at other places. What finer patches do not change leaves them at least half of the error.
        float of_patches = sqrt(max(push.error * push.error - dot(fixed_, fixed_), 0.0));
        float aim = max(of_patches, fixed_error(sums[0].z) + 0.5 * push.error) / facet_share;
        chosen = 0.0;
        while (chosen < finest && error_at(chosen) > aim) chosen += 1.0;
        is_limited = error_at(chosen) > aim && finest < float(SHARE_LEVELS - 1);
        // Interpolates between this level and the one before.
        if (chosen > 0.0 && error_at(chosen) <= aim) {
            float before = log2(error_at(chosen - 1.0));
            float here = log2(error_at(chosen));
            chosen -= clamp((log2(aim) - here) / max(before - here, 1e-6), 0.0, 1.0);
        }
        // The more facets are mixed, the more may be so although their corners agree: they are divided, and looked at within.
        float hidden = 1.0 + (MOST_HIDDEN - 1.0) * min(sums[0].y / MANY_SHADOWS, 1.0);
        float unseen = min(push.error, max(COARSEST_ERROR, PART_OF_LARGE_ERROR * push.error)) / significance;
        float least = min(log2(FIRST_SHARE * hidden * MIN_PATCHES_PER_ERROR / unseen), finest);
        // Below the first level where the receiver gets hardly any light.
        chosen = chosen > 0.0 ? max(chosen, least) : least;
    }
    float flux = shares[receiver].flux;
    float of_facets = flux > 0.0 ? facet_share * error_at(chosen) : 0.0;
    // Other workgroups read the flux.
    shares[receiver].patch_share = FIRST_SHARE * exp2(-chosen);
    shares[receiver].error = push.error > 0.0 ? length(vec3(of_facets, fixed_)) : 0.0;
    shares[receiver].is_limited = is_limited && flux > 0.0 ? 1 : 0;
    shares[receiver].pieces = PIECES[piece_level];
}
