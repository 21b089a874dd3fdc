// visible_flux: lowers the flux of facets by what their corners see, so that shares of a receiver's flux are shares of the light that arrives,
// and marks facets that a shadow crosses.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
FACETS(0)
layout(std430, binding = 1) buffer Images { FacetImage facet_images[]; }; // per pair and receiver
layout(std430, binding = 2) readonly buffer Visibility { uint visibility[]; };
#include "facet_push.glsl"
#include "facet_visibility.glsl"
#include "blocks.glsl"

// Part of its flux that a facet counts with where all corners are blocked: few of these have light between the corners.
const float HIDDEN = 0.125;

void main() {
    uint pair = thread_index();
    if (pair >= push.facet_count * push.light_count) return;
    Facet facet = facet_at(push.first_facet + pair % push.facet_count);
    for (uint receiver = 0; receiver < push.receiver_count; receiver++) {
        uint lit = 0;
        uint blocked = 0;
        bool is_mixed = false;
        for (uint target = receiver * push.lobes; target < (receiver + 1) * push.lobes; target++) {
            uvec3 states = states_at_corners(facet, pair / push.facet_count, target);
            for (int i = 0; i < 3; i++) {
                if (states[i] == LIT) lit++;
                if (states[i] == BLOCKED) blocked++;
            }
            is_mixed = is_mixed || any(equal(states, uvec3(BLOCKED))) && any(equal(states, uvec3(LIT)));
        }
        uint image = pair * push.receiver_count + receiver;
        if (blocked > 0) facet_images[image].flux *= max(float(lit) / float(lit + blocked), HIDDEN);
        if (is_mixed) facet_images[image].deviation_longest |= HAS_SHADOW_EDGE;
    }
}
