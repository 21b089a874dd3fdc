// environment_footprint: projects environment cells by patch clusters onto the planar receivers that a cluster is close
// to, as footprints. The other receivers are left to pinhole_image.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Triangles { Triangle triangles[]; };
layout(std430, binding = 1) readonly buffer Nodes { Grid grid; Node nodes[]; };
layout(std430, binding = 2) readonly buffer Objects { Object objects[]; };
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
layout(std430, binding = 4) readonly buffer PlanarReceivers { PlanarReceiver planar_receivers[]; };
layout(std430, binding = 5) readonly buffer Patches { Patch patches[]; };
layout(std430, binding = 6) readonly buffer Profiles { Profile profiles[]; };
// 2 lobes receiver_count slots per pair; the used slots come first.
layout(std430, binding = 7) writeonly buffer Footprints { Footprint footprints[]; };
layout(std430, binding = 8) writeonly buffer Counts { uint counts[]; };
layout(std430, binding = 9) writeonly buffer GroupCounts { uvec2 group_counts[]; }; // footprints, lit pairs
layout(std430, binding = 10) buffer Coarse { uint coarse[]; }; // per receiver: bit l is set where footprints are in level l
layout(std430, binding = 11) readonly buffer Pairs { uvec2 pairs[]; }; // patch cluster and environment cell
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "kernel_fit.glsl"
#include "flux.glsl"
#include "cluster.glsl"
#include "footprint.glsl"
#include "slots.glsl"

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uvec2 pair = pairs[push.first_pair + local];
        Patch patch_ = patches[pair.x];
        Light light = lights[pair.y];
        LightDisc disc = disc_at(light, patch_.position);
        float eta = orient_toward(patch_, disc.direction);
        bool is_close = false;
        for (uint index = 0; index < push.receiver_count && !is_close; index++) is_close = is_close_cluster(patch_, planar_receivers[index]);
        uint first_slot = local * 2 * push.lobes * push.receiver_count;
        vec3 flux[2];
        if (is_close && flux_of(patch_, light, disc, eta, flux)) {
            vec3 normal = normalize(patch_.normal);
            for (uint lobe = 0; lobe < push.lobes; lobe++) {
                if (flux[lobe] == vec3(0.0)) continue;
                float lobe_eta = lobe == 0 ? 0.0 : eta;
                vec3 r = outgoing_direction(disc.direction, normal, lobe_eta);
                for (uint index = 0; index < push.receiver_count; index++) {
                    PlanarReceiver receiver = planar_receivers[index];
                    // The ray must travel toward the plane's front.
                    if (!is_close_cluster(patch_, receiver) || dot(r, receiver.normal) >= -1e-6) continue;
                    PatchImage image;
                    image.mean_distance = dot(receiver.origin - patch_.position, receiver.normal) / dot(r, receiver.normal);
                    image.centre = to_texels(receiver, patch_.position + image.mean_distance * r);
                    image.root = cluster_image(patch_, disc.direction, normal, lobe_eta, receiver, r, image.mean_distance);
                    count += footprints_of(patch_, image, light, disc, flux[lobe], lobe_eta, r, receiver, index, true, first_slot + count);
                }
            }
        }
    }
    count_slots(push.pair_count, count);
}
