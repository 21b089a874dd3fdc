// environment_footprint: projects environment cells by patch clusters onto the planar receivers that a cluster is close
// to, as footprints. The other receivers are left to pinhole_image.comp.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NODES(1)
OBJECTS(2)
LIGHTS(3)
PLANAR_RECEIVERS(4)
layout(std430, binding = 5) readonly buffer Patches { Patch patches[]; };
layout(std430, binding = 6) readonly buffer Profiles { Profile profiles[]; };
// FOOTPRINT_SLOTS lobes receiver_count slots per pair; the used slots come first.
layout(std430, binding = 7) writeonly buffer Footprints { Footprint footprints[]; };
layout(std430, binding = 8) writeonly buffer Counts { uint counts[]; };
layout(std430, binding = 9) writeonly buffer GroupCounts { uvec2 group_counts[]; }; // footprints, lit pairs
layout(std430, binding = 10) buffer Coarse { uint coarse[]; }; // per receiver: bit l is set where footprints are in level l
layout(std430, binding = 11) readonly buffer Pairs { uvec2 pairs[]; }; // patch cluster and environment cell
CLUSTER_STARTS_OF(12)
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "kernel_fit.glsl"
#include "perspective.glsl"
#include "level_kernel.glsl"
#include "flux.glsl"
#include "above.glsl"
#include "cluster.glsl"
#include "cluster_light.glsl"
#include "slots.glsl"

// A footprint that subtends less than this angle, rad, spreads its flux evenly on the plane instead of over directions.
const float MAX_PLANAR_ANGLE = 0.05;

// Share of a kernel of the variance `variance` that is above -1 (evaluated for the profile (1 - x^2)^2).
float landing_share(float variance) {
    float q = min(0.5 + 0.5 * inversesqrt(7.0 * variance), 1.0);
    return q * q * q * (10.0 + q * (6.0 * q - 15.0));
}

// Root of the covariance, in texels, that the directions of the light give to the image: that within each of the nine parts of
// the cell, 1/9 of the cell's, plus that between the parts.
mat2 light_image(Light light, OutgoingLight outgoing, vec3 normal, float eta, PlanarReceiver receiver, float path) {
    vec3 r = outgoing.direction;
    vec2 a = landing_change(receiver, r, path / 3.0 * outgoing_change(outgoing.toward, normal, light.axis1, vec3(0.0), eta));
    vec2 b = landing_change(receiver, r, path / 3.0 * outgoing_change(outgoing.toward, normal, light.axis2, vec3(0.0), eta));
    // Rows of the linear map from changes of direction to texels.
    mat3 axes = mat3(1.0);
    mat3x2 change = mat3x2(
        landing_change(receiver, r, path * axes[0]), landing_change(receiver, r, path * axes[1]), landing_change(receiver, r, path * axes[2]));
    mat2 between = change * outgoing.covariance * transpose(change);
    vec3 covariance = outer2(a) + outer2(b) + CELL_SPREAD * vec3(between[0][0], between[0][1], between[1][1]);
    float root = sqrt(max(covariance.x, 1e-12));
    float beside = covariance.y / root;
    return mat2(root, beside, 0.0, sqrt(max(covariance.z - beside * beside, 0.0)));
}

// The image of a patch on the plane of a receiver, in texels.
struct PatchImage {
    vec2 centre;
    float mean_distance; // from the patch along r, m
    mat2 root;           // of the covariance by the patch
    mat2 light_root;     // of the covariance by the light
};

// Writes the footprints of `patch_` with `flux`, W, on `receiver`, number `index`, along the outgoing direction r of the
// patch's centroid, to the buffer from `slot` on. Returns their number: 0, 1, or 2 where the patch's plane folds the
// first footprint. eta = 0: reflected light; otherwise refracted.
//
// Footprints are not returned: lavapipe copies an array of them at every call, which took a quarter of the time on a
// scene of two lobes and five receivers.
uint footprints_of(Patch patch_, PatchImage image, vec3 flux, float eta, vec3 r, PlanarReceiver receiver, uint index, uint slot) {
    vec2 centre = image.centre;
    float mean_distance = image.mean_distance;
    // A flat patch preserves the sharpness of the image. A wide kernel, whose sum is even to 0.1 %, therefore blurs
    // nothing but the caster's silhouette.
    bool is_flat = has_constant_normal(patch_);
    mat2 of_patch = image.root * sqrt(is_flat ? push.flat_spread : push.spread);

    Kernel kernel = kernel_for(of_patch, image.light_root, 1.0 / 12.0, is_flat ? SHARPEST : SHARPEST_CURVED);

    // The patch sends its light to one side of its own plane, which intersects the receiver in the line 1 + edge.d = 0.
    // The footprint's part behind the line is folded back: a second footprint, the first one reflected at the line in
    // the metric of the conic, is added, and both are clipped at the line. The fold conserves the flux. Where patches
    // end at the line, it also keeps their sum even.
    vec3 ahead = from_texels(receiver, centre) - patch_.position;
    vec3 n = cross(patch_.edge1, patch_.edge2) * (eta == 0.0 ? 1.0 : -1.0);
    float before = dot(n, ahead);
    vec2 edge = vec2(
        dot(n, receiver.edge_u) / float(receiver.width),
        -dot(n, receiver.edge_v) / float(receiver.height)) / before;
    bool folded = before > 0.0 && quadratic2(kernel.profile.support * kernel.covariance, edge) > 1.0;

    LevelKernel here = in_level(kernel, centre, receiver);
    kernel = here.kernel;
    centre = here.centre;
    float scale = here.scale;
    vec2 half_size = here.half_size;
    vec2 tile_low = here.tile_low;
    vec2 tile_high = here.tile_high;
    vec3 conic = conic_of(kernel);

    // Bounding box. The footprint is dropped where its box misses the tile.
    vec2 low = centre - half_size;
    vec2 high = centre + half_size;
    bool has_few_texels = is_small(here);

    // A footprint that spreads mainly over directions is wide: d^T conic d <= s^2 is its ellipse.
    vec2 texel_u = vec2(length(receiver.edge_u) / float(receiver.width), length(receiver.edge_v) / float(receiver.height));
    vec2 bulge = texel_u * texel_u / (mean_distance * mean_distance * scale * scale);
    vec2 slant = slant_of(receiver, r, mean_distance) / scale;
    bool is_wide = !folded && !has_few_texels && dot(abs(slant) + sqrt(bulge), half_size) > MAX_PLANAR_ANGLE;
    if (is_wide) {
        // The part of the kernel that misses the plane is added to the rest: all of the flux reaches the plane.
        flux /= landing_share(quadratic2(kernel.covariance, slant));
        vec3 q = conic - vec3(bulge.x, 0.0, bulge.y);
        float determinant = q.x * q.z - q.y * q.y;
        low = tile_low;
        high = tile_high;
        if (q.x > 0.0 && determinant > 1e-3 * q.x * q.z) {
            vec3 inverse = vec3(q.z, -q.y, q.x) / determinant;
            vec2 middle = centre + vec2(inverse.x * slant.x + inverse.y * slant.y, inverse.y * slant.x + inverse.z * slant.y);
            half_size = sqrt((1.0 + quadratic2(inverse, slant)) * inverse.xz);
            low = middle - half_size;
            high = middle + half_size;
        }
    } else {
        vec4 reached = extent_of(kernel.profile.support * kernel.covariance, -slant) + centre.xyxy;
        if (any(greaterThan(reached.xy, tile_high)) || any(lessThan(reached.zw, tile_low))) return 0;
        bulge = slant = vec2(0.0);
    }
    low = clamp(low, tile_low, tile_high);
    high = clamp(high, tile_low, tile_high);
    if (!(all(lessThan(low, high)) && kernel.determinant > 0.0)) return 0;

    if (here.level > 0) atomicOr(coarse[index], 1u << here.level);

    // The fold, in texels of the level.
    edge /= scale;
    vec3 inverse = kernel.profile.support * kernel.covariance;
    float reach = quadratic2(inverse, edge);
    folded = folded && reach > 1.0;
    vec2 shift = vec2(0.0);
    vec3 clip = vec3(0.0, 0.0, 1.0);
    vec3 folded_clip = clip;
    if (folded) {
        shift = vec2(inverse.x * edge.x + inverse.y * edge.y, inverse.y * edge.x + inverse.z * edge.y) * (-2.0 / reach);
        float distance_ = 1.0 / length(edge);
        clip = vec3(edge * distance_, 0.5 + distance_);
        folded_clip = vec3(edge * distance_, 0.5 - distance_);
    }

    // Converts W to W/m^2 in a texel of the level.
    float peak = peak_of(kernel);
    vec3 irradiance = flux * (scale * scale * peak / texel_area(receiver));

    // A small footprint is normalised over its texels.
    if (has_few_texels) {
        float sum = sum_over_texels(here, folded, shift, clip);
        if (sum > 0.0) irradiance /= sum * peak;
    }
    Footprint footprint = Footprint(centre, slant, conic, kernel.profile.flatness, irradiance, bulge.x, clip, bulge.y, low, high);
    footprints[slot] = footprint;
    if (!folded) return 1;
    footprint.centre += shift;
    footprint.clip = folded_clip;
    footprint.lower = clamp(centre + shift - half_size, tile_low, tile_high);
    footprint.upper = clamp(centre + shift + half_size, tile_low, tile_high);
    footprints[slot + 1] = footprint;
    return 2;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uvec2 pair = pairs[push.first_pair + local];
        Patch patch_ = patches[pair.x];
        Light light = light_at(pair.y);
        float eta = orient_toward(patch_, light.place);
        float side = dot(patch_.normal, patches[pair.x].normal) < 0.0 ? -1.0 : 1.0;
        vec3 normal = normalize(patch_.normal);
        Cell cell = cell_of(light);
        vec2 point = pair_point(pair);
        uint first_slot = local * FOOTPRINT_SLOTS * push.lobes * push.receiver_count;
        for (uint lobe = 0; lobe < (eta > 0.0 ? 2 : 1); lobe++) {
            float lobe_eta = lobe == 0 ? 0.0 : eta;
            for (uint index = 0; index < push.receiver_count; index++) {
                PlanarReceiver receiver = planar_receiver_at(index);
                if (!is_close_cluster(patch_, receiver)) continue;
                OutgoingLight outgoing;
                if (!outgoing_light(patch_, cell, eta, lobe == 1, receiver, point.x, outgoing)) continue;
                if (!arrives(pair.x, side, outgoing.ray, lobe_eta, receiver, point.y)) continue;
                vec3 r = outgoing.direction;
                PatchImage image;
                image.mean_distance = dot(receiver.origin - patch_.position, receiver.normal) / dot(r, receiver.normal);
                image.centre = to_texels(receiver, patch_.position + image.mean_distance * r);
                image.root = cluster_image(patch_, outgoing.toward, normal, lobe_eta, receiver, r, image.mean_distance);
                image.light_root = light_image(light, outgoing, normal, lobe_eta, receiver, image.mean_distance);
                vec3 flux = light.power * patch_.area * outgoing.cosine;
                count += footprints_of(patch_, image, flux, lobe_eta, r, receiver, index, first_slot + count);
            }
        }
    }
    count_slots(push.pair_count, count);
}
