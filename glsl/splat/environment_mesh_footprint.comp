// environment_mesh_footprint: projects environment cells by patch clusters onto every mesh receiver, as footprints.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NODES(1)
OBJECTS(2)
LIGHTS(3)
layout(std430, binding = 4) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 5) readonly buffer AtlasNodes { AtlasNode atlas_nodes[]; };
layout(std430, binding = 6) readonly buffer Patches { Patch patches[]; };
layout(std430, binding = 7) readonly buffer Profiles { Profile profiles[]; };
// MESH_FOOTPRINT_SLOTS lobes receiver_count slots per pair; the used slots come first.
layout(std430, binding = 8) writeonly buffer MeshFootprints { MeshFootprint mesh_footprints[]; };
layout(std430, binding = 9) writeonly buffer Counts { uint counts[]; };
layout(std430, binding = 10) writeonly buffer GroupCounts { uvec2 group_counts[]; }; // footprints, lit pairs
layout(std430, binding = 11) readonly buffer Pairs { uvec2 pairs[]; }; // patch cluster and environment cell
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "kernel_fit.glsl"
#include "flux.glsl"
#include "mesh_footprint.glsl"
#include "slots.glsl"

// The beam of a patch cluster, from derivatives at its centroid: rays from the midpoints of a large patch may diverge
// too much.
LightBeam cluster_beam(Patch patch_, Light light, LightDisc disc, float eta) {
    LightBeam beam;
    vec3 n = normalize(patch_.normal);
    beam.start = patch_.position;
    beam.direction = outgoing_direction(disc.direction, n, eta);
    basis(beam.direction, beam.a, beam.b);
    beam.middle = beam.drift = vec2(0.0);
    mat2x3 across = mat2x3(beam.a, beam.b);
    beam.sharpest = SHARPEST_CURVED;
    for (int i = 0; i < 2; i++) {
        vec2 st = sqrt(push.spread) * AXES[i];
        vec3 normal_change = normalize_change(patch_.normal, st.x * patch_.normal_du + st.y * patch_.normal_dv);
        beam.of_patch[i] = (st.x * patch_.edge1 + st.y * patch_.edge2) * across;
        beam.patch_growth[i] = outgoing_change(disc.direction, n, vec3(0.0), normal_change, eta) * across;
    }
    beam.of_light = mat2(0.0);
    beam.end = FAR;
    beam.light_growth = light_growth(light, disc, n, eta, across);
    return beam;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uvec2 pair = pairs[push.first_pair + local];
        Patch patch_ = patches[pair.x];
        Light light = light_at(pair.y);
        LightDisc disc = disc_at(light, patch_.position);
        float eta = orient_toward(patch_, disc.direction);
        uint first_slot = local * MESH_FOOTPRINT_SLOTS * push.lobes * push.receiver_count;
        vec3 flux[2];
        if (flux_of(patch_, light, disc, eta, flux)) {
            for (uint lobe = 0; lobe < push.lobes; lobe++) {
                if (flux[lobe] == vec3(0.0)) continue;
                LightBeam beam = cluster_beam(patch_, light, disc, lobe == 0 ? 0.0 : eta);
                count += project_beam(beam, flux[lobe], patch_.triangle, first_slot + count);
            }
        }
    }
    count_slots(push.pair_count, count);
}
