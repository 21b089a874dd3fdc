// facet_count: divides facets into patches of about equal flux.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
FACET_IMAGES(0)
layout(std430, binding = 1) readonly buffer Shares { ReceiverShare shares[]; };
layout(std430, binding = 2) buffer Patches { FacetPatches facet_patches[]; };
// Patches, and points of the lattice of (division + 1) (division + 2) / 2 patch corners.
layout(std430, binding = 3) writeonly buffer PatchNumbers { uvec2 patch_numbers[]; };
#include "facet_push.glsl"
#include "error_model.glsl"
#include "blocks.glsl"

uint division_of(uint pair) {
    if (push.division > 0) return push.division;
    float most = 1.0;
    for (uint index = 0; index < push.receiver_count; index++) {
        ReceiverShare share = shares[index];
        if (share.flux <= 0.0) continue;
        float part = facet_image_at(pair * push.receiver_count + index).flux / share.flux;
        most = max(most, facet_division(part, share.patch_share));
    }
    return uint(most);
}

void main() {
    uint pair = thread_index();
    if (pair >= push.facet_count * push.light_count) return;
    FacetPatches patches = facet_patches[pair];
    uint n = 0;
    if (patches.targets != 0) {
        n = division_of(pair);
        facet_patches[pair].division = n;
    }
    bool has_lattice = n > 1 && push.can_occlude != 0;
    patch_numbers[pair] = uvec2(n * n, has_lattice ? (n + 1) * (n + 2) / 2 : 0);
}
