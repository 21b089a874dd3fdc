// mesh_footprint: projects the image of every light by every patch onto every mesh receiver, as footprints. The light
// of a patch is a beam around its central ray. The section of the beam across the ray is linear in the distance. A
// footprint is the part of the beam that meets one square of texels. The squares come from a quadtree, which is refined
// where the beam touches it as long as slots are free.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer Triangles { Triangle triangles[]; };
layout(std430, binding = 1) readonly buffer Nodes { Grid grid; Node nodes[]; };
layout(std430, binding = 2) readonly buffer Objects { Object objects[]; };
layout(std430, binding = 3) readonly buffer Lights { Light lights[]; };
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
#include "slots.glsl"

// Squared support radius of the max_trace kernel, p = SHARPEST: 2 (p + 2).
const float MAX_SUPPORT = 18.0;
// Lower bound on a texel's smaller variance over the larger, for texels seen edge on.
const float MIN_VARIANCE_RATIO = 1e-3;

// Root of the covariance of the light's directions across the ray.
mat2 light_growth(Light light, LightDisc disc, vec3 n, float eta, mat2x3 across) {
    vec3 a, b;
    light_axes(light, disc, a, b);
    a = outgoing_change(disc.direction, n, a, vec3(0.0), eta);
    b = outgoing_change(disc.direction, n, b, vec3(0.0), eta);
    return mat2(a * across, b * across);
}

// The light of a patch. In the axes a and b across `direction`, the section at the distance s has the centre middle + s
// drift and a root of covariance (of_patch + s patch_growth, s light_growth).
struct LightBeam {
    vec3 start;
    vec3 direction;      // unit
    vec3 a;
    vec3 b;
    vec2 middle;
    vec2 drift;
    mat2 of_patch;
    mat2 patch_growth;
    mat2 light_growth;
    float sharpest;  // of the kernel
};

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
    beam.light_growth = light_growth(light, disc, n, eta, across);
    return beam;
}

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

    beam.light_growth = light_growth(light, disc, normalize(patch_.normal), eta, across);
    return true;
}

// Variance of the section at the distance s in the direction u.
float variance_along(LightBeam beam, vec2 u, float s) {
    vec2 of_patch = u * (beam.of_patch + s * beam.patch_growth);
    vec2 of_light = u * (s * beam.light_growth);
    return dot(of_patch, of_patch) + dot(of_light, of_light);
}

// Sum of the products of the entries.
float inner(mat2 a, mat2 b) {
    return dot(a[0], b[0]) + dot(a[1], b[1]);
}

// Relative growth of the section's width with the distance, at the distance s, 1/m.
float growth_at(LightBeam beam, float s) {
    mat2 of_patch = beam.of_patch + s * beam.patch_growth;
    mat2 of_light = s * beam.light_growth;
    float variance = inner(of_patch, of_patch) + inner(of_light, of_light);
    float change = inner(of_patch, beam.patch_growth) + inner(of_light, beam.light_growth);
    return variance > 0.0 ? change / variance : 0.0;
}

// Whether light may fall on a node. False only if some line separates the beam, out to the `support` of its kernel,
// from the node's sphere. The variance is convex in s, so its ends bound it.
bool may_light(LightBeam beam, AtlasNode node, float support) {
    vec3 to_node = node.centre - beam.start;
    float s = dot(to_node, beam.direction);
    bool lit = node.radius >= 0.0 && s + node.radius > 0.0 && dot(node.axis, beam.direction) < node.sine;
    if (!lit) return false;
    vec2 off = to_node * mat2x3(beam.a, beam.b) - beam.middle - s * beam.drift;
    float distance_ = length(off);
    if (distance_ <= node.radius) return true;
    vec2 u = off / distance_;
    float nearer = variance_along(beam, u, max(s - node.radius, 0.0));
    float farther = variance_along(beam, u, s + node.radius);
    float reach = sqrt(support * (max(nearer, farther) + node.max_trace));
    return distance_ <= reach + node.radius * (1.0 + length(beam.drift));
}

// Unpacks a node of the quadtree: level | x << 4 | y << 18.
uvec3 unpacked(uint node) {
    return uvec3(node & 15u, node >> 4 & 0x3fffu, node >> 18);
}

uint packed(uvec3 node) {
    return node.x | node.y << 4 | node.z << 18;
}

AtlasNode node_at(MeshReceiver receiver, uvec3 node) {
    uint first = receiver.first_node;
    for (uint level = 0; level < node.x; level++) first += 1u << 2 * (receiver.levels - level);
    return atlas_nodes[first + (node.z << receiver.levels - node.x) + node.y];
}

// The footprint on one node. Returns false where the beam misses the node.
bool project_to_node(MeshReceiver receiver, uvec3 place, LightBeam beam, vec3 flux, vec3 occluder, vec3 occluder_normal, out MeshFootprint footprint) {
    AtlasNode node = node_at(receiver, place);
    float s = max(dot(node.centre - beam.start, beam.direction), 0.0);
    // Coordinates across the ray in which the texels' covariance is that of unit squares, I/12.
    vec3 ca = vec3(dot(vec3(node.diagonal.x, node.off_diagonal.xy), beam.a),
        dot(vec3(node.off_diagonal.x, node.diagonal.y, node.off_diagonal.z), beam.a),
        dot(vec3(node.off_diagonal.yz, node.diagonal.z), beam.a));
    vec3 cb = vec3(dot(vec3(node.diagonal.x, node.off_diagonal.xy), beam.b),
        dot(vec3(node.off_diagonal.x, node.diagonal.y, node.off_diagonal.z), beam.b),
        dot(vec3(node.off_diagonal.yz, node.diagonal.z), beam.b));
    float aa = 12.0 * dot(beam.a, ca);
    float ab = 12.0 * dot(beam.a, cb);
    float bb = 12.0 * dot(beam.b, cb);
    float min_variance = MIN_VARIANCE_RATIO * (aa + bb);
    float root_a = sqrt(aa + min_variance);
    float root_ab = ab / root_a;
    float root_b = sqrt(max(bb + min_variance - root_ab * root_ab, min_variance));
    mat2 to_texels = mat2(1.0 / root_a, -root_ab / (root_a * root_b), 0.0, 1.0 / root_b);
    mat2 of_patch = to_texels * (beam.of_patch + s * beam.patch_growth);
    mat2 of_light = to_texels * (s * beam.light_growth);
    Kernel kernel = kernel_for(of_patch, of_light, 1.0 / 12.0, beam.sharpest);
    if (!(kernel.determinant > 0.0) || !may_light(beam, node, kernel.profile.support)) return false;

    vec2 middle = beam.middle + s * beam.drift;
    uvec2 size = uvec2(LEAF << place.x);
    uvec2 tile = uvec2(receiver.tile_x, receiver.tile_y);
    uvec2 low = tile + place.yz * size;
    uvec2 high = min(low + size, tile + uvec2(receiver.width, receiver.height));
    footprint.centre = beam.start + s * beam.direction + middle.x * beam.a + middle.y * beam.b;
    footprint.flatness = kernel.profile.flatness;
    footprint.u = beam.a / root_a;
    footprint.v = (beam.b - root_ab * footprint.u) / root_b;
    footprint.travelled = s;
    footprint.low = low.x | low.y << 16;
    footprint.high = high.x | high.y << 16;
    footprint.direction = beam.direction;
    footprint.conic = conic_of(kernel);
    footprint.tolerance = 0.5 * sqrt(6.0 * node.max_trace);
    footprint.peak = flux * (peak_of(kernel) / (root_a * root_b));
    footprint.base = int(receiver.first_texel) - int(tile.x) - int(tile.y * receiver.width);
    footprint.stride = int(receiver.width);
    footprint.occluder = occluder;
    footprint.occluder_normal = occluder_normal;
    footprint.growth = growth_at(beam, s);
    return true;
}

// Writes the footprints of a beam with `flux`, W, from `slot` on, and returns their number.
uint project_to_mesh(MeshReceiver receiver, LightBeam beam, vec3 flux, vec3 occluder, vec3 occluder_normal, uint slot) {
    uint now[MESH_FOOTPRINT_SLOTS];
    uint next[MESH_FOOTPRINT_SLOTS];
    uint count = 1;
    now[0] = packed(uvec3(receiver.levels, 0, 0));
    for (uint level = receiver.levels; level > 0; level--) {
        uint found = 0;
        for (uint i = 0; i < count; i++) {
            uint others = count - 1 - i;
            uvec3 node = unpacked(now[i]);
            uint first = found;
            bool fits = node.x == level;
            for (uint child = 0; fits && child < 4; child++) {
                uvec3 place = uvec3(level - 1, 2 * node.yz + uvec2(child & 1, child >> 1));
                if (!may_light(beam, node_at(receiver, place), MAX_SUPPORT)) continue;
                fits = found + others < MESH_FOOTPRINT_SLOTS;
                if (fits) next[found++] = packed(place);
            }
            if (!fits) {
                found = first;
                next[found++] = now[i];
            }
        }
        count = found;
        for (uint i = 0; i < count; i++) now[i] = next[i];
    }
    uint written = 0;
    for (uint i = 0; i < count; i++) {
        MeshFootprint footprint;
        if (project_to_node(receiver, unpacked(now[i]), beam, flux, occluder, occluder_normal, footprint)) mesh_footprints[slot + written++] = footprint;
    }
    return written;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uint pair = push.first_pair + local;
        uvec2 members = push.clustered != 0 ? pairs[pair] : uvec2(pair % push.patch_count, pair / push.patch_count);
        Patch patch_ = patches[members.x];
        Light light = lights[members.y];
        LightDisc disc = disc_at(light, patch_.position);
        float eta = orient_toward(patch_, disc.direction);
        vec3 flux[2];
        if (flux_of(patch_, light, disc, eta, flux)) {
            uint first_slot = local * MESH_FOOTPRINT_SLOTS * push.lobes * push.receiver_count;
            for (uint lobe = 0; lobe < push.lobes; lobe++) {
                LightBeam beam;
                if (flux[lobe] == vec3(0.0)) continue;
                float lobe_eta = lobe == 0 ? 0.0 : eta;
                if (push.clustered != 0) {
                    beam = cluster_beam(patch_, light, disc, lobe_eta);
                } else if (!beam_of(patch_, light, disc, lobe_eta, beam)) {
                    continue;
                }
                vec3 at = vec3(0.0);
                vec3 occluder_normal = vec3(0.0);
                if (push.can_occlude != 0) {
                    Hit occluder = nearest(beam.start, beam.direction, patch_.triangle, OCCLUDES);
                    if (occluder.triangle != NO_TRIANGLE) {
                        at = beam.start + occluder.distance * beam.direction;
                        occluder_normal = normalize(cross(triangles[occluder.triangle].edge1, triangles[occluder.triangle].edge2));
                        if (dot(occluder_normal, beam.direction) > 0.0) occluder_normal = -occluder_normal;
                    }
                }
                for (uint index = 0; index < push.receiver_count; index++) {
                    count += project_to_mesh(mesh_receivers[index], beam, flux[lobe], at, occluder_normal, first_slot + count);
                }
            }
        }
    }
    count_slots(push.pair_count, count);
}
