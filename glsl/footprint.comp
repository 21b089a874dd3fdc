// footprint: projects the image of every light by every patch onto every planar receiver, as a footprint.
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
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "kernel_fit.glsl"
#include "flux.glsl"
#include "clip.glsl"
#include "footprint.glsl"
#include "slots.glsl"

// Projects `patch_` with `flux`, W, onto the receiver `index`: see footprints_of().
uint project_footprints(Patch patch_, Light light, LightDisc disc, vec3 flux, float eta, uint index, uint slot) {
    PlanarReceiver receiver = planar_receivers[index];
    vec3 m = receiver.normal;
    if (dot(receiver.origin - patch_.position, m) >= 0.0) return 0;
    vec3 r = outgoing_direction(disc.direction, normalize(patch_.normal), eta);
    // The ray must travel toward the plane's front.
    if (dot(r, m) >= -1e-6) return 0;
    vec2 places[3];
    PatchImage image = PatchImage(vec2(0.0), 0.0, mat2(0.0));
    for (int i = 0; i < 3; i++) {
        vec2 st = MIDPOINTS[i];
        vec3 x = patch_.position + st.x * patch_.edge1 + st.y * patch_.edge2;
        vec3 n = normalize(patch_.normal + st.x * patch_.normal_du + st.y * patch_.normal_dv);
        vec3 way = outgoing_direction(disc_at(light, x).direction, n, eta);
        float along = dot(way, m);
        if (along >= -1e-6) return 0;
        float d = dot(receiver.origin - x, m) / along;
        places[i] = to_texels(receiver, x + d * way);
        image.centre += places[i] / 3.0;
        image.mean_distance += d / 3.0;
    }
    image.root = mat2((places[0] - places[1]) * sqrt(1.0 / 6.0), (places[2] - image.centre) * sqrt(0.5));
    return footprints_of(patch_, image, light, disc, flux, eta, r, receiver, index, false, slot);
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uint pair = push.first_pair + local;
        Patch patch_ = patches[pair % push.patch_count];
        Light light = lights[push.first_light + pair / push.patch_count];
        float eta = orient_toward(patch_, disc_at(light, patch_.position).direction);
        uint first_slot = local * 2 * push.lobes * push.receiver_count;
        // The whole patch lights all receivers that do not clip it, then the clipped patch lights each receiver that
        // clips it.
        uint clip = push.receiver_count;
        uint next = 0;
        do {
            Patch clipped = patch_;
            if (clip < push.receiver_count) clipped = clipped_patch(patch_, planar_receivers[clip]);
            LightDisc disc = disc_at(light, clipped.position);
            vec3 flux[2];
            if (flux_of(clipped, light, disc, eta, flux)) {
                for (uint lobe = 0; lobe < push.lobes; lobe++) {
                    if (flux[lobe] == vec3(0.0)) continue;
                    for (uint index = 0; index < push.receiver_count; index++) {
                        if (!is_lit_by(patch_, index, clip)) continue;
                        count += project_footprints(clipped, light, disc, flux[lobe], lobe == 0 ? 0.0 : eta, index, first_slot + count);
                    }
                }
            }
            clip = next_clipping_receiver(patch_, next);
            next = clip + 1;
        } while (clip < push.receiver_count);
    }
    count_slots(push.pair_count, count);
}
