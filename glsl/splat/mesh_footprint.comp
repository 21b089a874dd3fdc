// mesh_footprint: projects the image of every light by every patch onto every mesh receiver, as footprints.
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
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "light_part.glsl"
#include "kernel_fit.glsl"
#include "flux.glsl"
#include "mesh_footprint.glsl"
#include "slots.glsl"

// The beam of a patch. Returns false where the rays from the midpoints diverge too much.
bool beam_of(Patch patch_, Light light, LightDisc disc, float eta, out LightBeam beam) {
    vec3 from[3];
    vec3 directions[3];
    vec3 sum = vec3(0.0);
    for (int i = 0; i < 3; i++) {
        vec2 st = MIDPOINTS[i];
        from[i] = st.x * patch_.edge1 + st.y * patch_.edge2;
        vec3 n = normalize(patch_.normal + st.x * patch_.normal_du + st.y * patch_.normal_dv);
        directions[i] = outgoing_direction(disc_at(light, patch_.position + from[i]).direction, n, eta);
        sum += directions[i];
    }
    beam.start = patch_.position;
    beam.direction = normalize(sum);
    basis(beam.direction, beam.a, beam.b);
    mat2x3 across = mat2x3(beam.a, beam.b);
    vec2 at[3];
    vec2 slope[3];
    beam.middle = beam.drift = vec2(0.0);
    for (int i = 0; i < 3; i++) {
        float forward = dot(directions[i], beam.direction);
        if (!(forward > 0.2)) return false;
        slope[i] = directions[i] * across / forward;
        at[i] = from[i] * across - slope[i] * dot(from[i], beam.direction);
        beam.middle += at[i] / 3.0;
        beam.drift += slope[i] / 3.0;
    }
    bool is_flat = has_constant_normal(patch_);
    float deviation = sqrt(is_flat ? push.flat_spread : push.spread);
    beam.sharpest = is_flat ? SHARPEST : SHARPEST_CURVED;
    beam.of_patch = deviation * mat2((at[0] - at[1]) * sqrt(1.0 / 6.0), (at[2] - beam.middle) * sqrt(0.5));
    beam.patch_growth = deviation * mat2((slope[0] - slope[1]) * sqrt(1.0 / 6.0), (slope[2] - beam.drift) * sqrt(0.5));
    beam.of_light = mat2(0.0);
    beam.end = FAR;
    beam.light_growth = light_growth(light, disc, normalize(patch_.normal), eta, across);
    return true;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uint pair = push.first_pair + local;
        Patch patch_ = patches[pair % push.patch_count];
        Light light = part_seen_from(light_at(pair / push.patch_count), patch_.position);
        LightDisc disc = disc_at(light, patch_.position);
        float eta = orient_toward(patch_, disc.direction);
        uint first_slot = local * MESH_FOOTPRINT_SLOTS * push.lobes * push.receiver_count;
        vec3 flux[2];
        if (flux_of(patch_, light, disc, eta, flux)) {
            for (uint lobe = 0; lobe < push.lobes; lobe++) {
                if (flux[lobe] == vec3(0.0) || lobe == 1 && is_dispersing(object_at(patch_.object), light)) continue;
                LightBeam beam;
                if (!beam_of(patch_, light, disc, lobe == 0 ? 0.0 : eta, beam)) continue;
                count += project_beam(beam, flux[lobe], patch_.triangle, first_slot + count);
            }
        }
    }
    count_slots(push.pair_count, count);
}
