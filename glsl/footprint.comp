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
layout(std430, binding = 11) readonly buffer Pairs { uvec2 pairs[]; }; // patch cluster and environment cell
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "kernel_fit.glsl"
#include "flux.glsl"
#include "clip.glsl"
#include "slots.glsl"

// Footprints of at most this many texels are normalised over the texels that they touch.
const float MAX_NORMALISED_TEXELS = 36.0;
// A footprint of a patch cluster that subtends less than this angle, rad, spreads its flux evenly on the plane instead
// of over directions.
const float MAX_PLANAR_ANGLE = 0.05;

// Bounds of the plane's region that the rays within the ellipse d^T inverse(m) d <= 1 reach, as (low, high) relative to
// the centre. A ray meets the plane at d to first order, and at d / (1 + g.d) with perspective.
vec4 extent_of(vec3 m, vec2 g) {
    float gg = quadratic2(m, g);
    vec2 mg = vec2(m.x * g.x + m.y * g.y, m.y * g.x + m.z * g.y);
    vec2 discriminant = mg * mg + (1.0 - gg) * m.xz;
    vec2 root = sqrt(max(discriminant, 0.0));
    vec2 a = (-mg - root) / (1.0 - gg);
    vec2 b = (-mg + root) / (1.0 - gg);
    if (gg < 1.0) return vec4(a, b);
    // Some rays never meet the plane, and the region is unbounded.
    vec2 nearest = mg / (sqrt(gg) * (1.0 + sqrt(gg)));
    vec2 low = mix(vec2(-FAR), max(a, b), greaterThanEqual(nearest, max(a, b)));
    vec2 high = mix(vec2(FAR), min(a, b), lessThanEqual(nearest, min(a, b)));
    bvec2 all_ = lessThan(discriminant, vec2(0.0));
    return vec4(mix(low, vec2(-FAR), all_), mix(high, vec2(FAR), all_));
}

// Projects `patch_` with `flux`, W, onto the receiver `index`. Returns the number of footprints: 0, 1, or 2 where the
// patch's plane folds the first footprint. eta = 0: reflected light; otherwise refracted.
uint project_footprints(Patch patch_, Light light, LightDisc disc, vec3 flux, float eta, uint index, out Footprint footprints_[2]) {
    PlanarReceiver receiver = planar_receivers[index];
    vec3 m = receiver.normal;
    if (dot(receiver.origin - patch_.position, m) >= 0.0) return 0;
    vec3 normal = normalize(patch_.normal);
    vec3 r = outgoing_direction(disc.direction, normal, eta);
    // The ray must travel toward the plane's front.
    if (dot(r, m) >= -1e-6) return 0;
    // A flat patch preserves the sharpness of the image. A wide kernel, whose sum is even to 0.1 %, therefore blurs
    // nothing but the caster's silhouette.
    bool is_flat = has_constant_normal(patch_);
    float deviation = sqrt(is_flat ? push.flat_spread : push.spread);
    vec2 centre = vec2(0.0);
    float mean_distance = 0.0;
    mat2 of_patch;
    if (push.clustered == 0) {
        vec2 image[3];
        for (int i = 0; i < 3; i++) {
            vec2 st = MIDPOINTS[i];
            vec3 x = patch_.position + st.x * patch_.edge1 + st.y * patch_.edge2;
            vec3 n = normalize(patch_.normal + st.x * patch_.normal_du + st.y * patch_.normal_dv);
            vec3 way = outgoing_direction(disc_at(light, x).direction, n, eta);
            float along = dot(way, m);
            if (along >= -1e-6) return 0;
            float d = dot(receiver.origin - x, m) / along;
            image[i] = to_texels(receiver, x + d * way);
            centre += image[i] / 3.0;
            mean_distance += d / 3.0;
        }
        of_patch = mat2((image[0] - image[1]) * sqrt(1.0 / 6.0), (image[2] - centre) * sqrt(0.5));
    } else {
        // Derivatives at the centroid, because rays from the ends of a large patch may miss the plane.
        mean_distance = dot(receiver.origin - patch_.position, m) / dot(r, m);
        centre = to_texels(receiver, patch_.position + mean_distance * r);
        for (int i = 0; i < 2; i++) {
            vec2 st = AXES[i];
            vec3 normal_change = normalize_change(patch_.normal, st.x * patch_.normal_du + st.y * patch_.normal_dv);
            vec3 change = st.x * patch_.edge1 + st.y * patch_.edge2
                + mean_distance * outgoing_change(disc.direction, normal, vec3(0.0), normal_change, eta);
            of_patch[i] = texel_direction(receiver, change - r * (dot(change, m) / dot(r, m)));
        }
    }
    of_patch *= deviation;

    // The light's directions form a cone around r; this is the section of the cone with the plane.
    vec3 a, b;
    light_axes(light, disc, a, b);
    a = mean_distance * outgoing_change(disc.direction, normal, a, vec3(0.0), eta);
    b = mean_distance * outgoing_change(disc.direction, normal, b, vec3(0.0), eta);
    mat2 of_light = mat2(
        texel_direction(receiver, a - r * (dot(a, m) / dot(r, m))),
        texel_direction(receiver, b - r * (dot(b, m) / dot(r, m))));
    Kernel kernel = kernel_for(of_patch, of_light, 1.0 / 12.0, is_flat ? SHARPEST : SHARPEST_CURVED);

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

    // A footprint whose standard deviation is at least 2^l texels in all directions goes to level l, where it covers
    // fewer texels. Interpolation adds the variance (4^l - 1)/4, so the kernel is narrowed by that variance first.
    float variance = min(minor_eigenvalue(kernel.covariance, kernel.determinant), 1e6);
    int level = level_for(receiver, variance);
    Level tile = level_of(receiver, level);
    float scale = 1.0 / float(1 << level);
    vec2 origin = vec2(receiver.tile_x, receiver.tile_y);
    vec2 target_texel = clamp(centre, origin, origin + vec2(receiver.width, receiver.height));
    vec3 target = from_texels(receiver, target_texel);
    centre = vec2(tile.origin) + (centre - origin) * scale;
    kernel = rescaled(kernel, 0.25 * (float(1 << 2 * level) - 1.0), scale);

    // Bounding box. The footprint is dropped where its box misses the tile.
    vec2 tile_low, tile_high;
    level_bounds(tile, level, tile_low, tile_high);
    vec3 conic = conic_of(kernel);
    vec2 half_size = sqrt(kernel.profile.support * kernel.covariance.xz);
    vec2 low = centre - half_size;
    vec2 high = centre + half_size;
    vec2 box = ceil(high) - floor(low) - 0.5;
    bool is_small = box.x * box.y <= MAX_NORMALISED_TEXELS;

    // A footprint that spreads mainly over directions is wide: d^T conic d <= s^2 is its ellipse.
    vec2 texel_u = vec2(length(receiver.edge_u) / float(receiver.width), length(receiver.edge_v) / float(receiver.height));
    vec2 bulge = texel_u * texel_u / (mean_distance * mean_distance * scale * scale);
    vec2 slant = vec2(
        dot(r, receiver.edge_u) / float(receiver.width),
        -dot(r, receiver.edge_v) / float(receiver.height)) / (mean_distance * scale);
    bool is_wide = push.clustered != 0 && !folded && !is_small && dot(abs(slant) + sqrt(bulge), half_size) > MAX_PLANAR_ANGLE;
    if (is_wide) {
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

    // Visibility from the patch to the receiver's point nearest to the centre.
    if (push.can_occlude != 0 && occluded(patch_.position, target - patch_.position, SHADOW_RAY_END, patch_.triangle)) return 0;
    if (level > 0) atomicOr(coarse[index], 1u << level);

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
    if (is_small) {
        vec2 first = floor(centre - half_size) + 0.5;
        float sum = 0.0;
        for (float y = 0.0; y < box.y; y += 1.0) {
            for (float x = 0.0; x < box.x; x += 1.0) {
                vec2 d = first + vec2(x, y) - centre;
                float value = kernel_value(kernel.profile.flatness, quadratic2(conic, d));
                if (folded) value += kernel_value(kernel.profile.flatness, quadratic2(conic, d - shift));
                sum += value * clamp(clip.z + dot(clip.xy, d), 0.0, 1.0);
            }
        }
        if (sum > 0.0) irradiance /= sum * peak;
    }
    footprints_[0] = Footprint(centre, slant, conic, kernel.profile.flatness, irradiance, bulge.x, clip, bulge.y, low, high);
    footprints_[1] = footprints_[0];
    footprints_[1].centre += shift;
    footprints_[1].clip = folded_clip;
    footprints_[1].lower = clamp(centre + shift - half_size, tile_low, tile_high);
    footprints_[1].upper = clamp(centre + shift + half_size, tile_low, tile_high);
    return folded ? 2 : 1;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uint pair = push.first_pair + local;
        uvec2 members = push.clustered != 0 ? pairs[pair] : uvec2(pair % push.patch_count, push.first_light + pair / push.patch_count);
        Patch patch_ = patches[members.x];
        Light light = lights[members.y];
        LightDisc disc = disc_at(light, patch_.position);
        float eta = orient_toward(patch_, disc.direction);
        // A cluster that acts as a pinhole on every receiver is left to pinhole_image.comp.
        bool is_projected = push.clustered == 0;
        for (uint index = 0; index < push.receiver_count && !is_projected; index++) is_projected = is_close_cluster(patch_, planar_receivers[index]);
        uint first_slot = local * 2 * push.lobes * push.receiver_count;
        // The whole patch lights all receivers that do not clip it, then the clipped patch lights each receiver that
        // clips it. The triangle of a cluster approximates another shape and is not clipped.
        int clip = -1;
        do {
            Patch clipped = patch_;
            if (clip >= 0) clipped = clipped_patch(patch_, planar_receivers[clip]);
            LightDisc clipped_disc = disc_at(light, clipped.position);
            vec3 flux[2];
            if (is_projected && flux_of(clipped, light, clipped_disc, eta, flux)) {
                for (uint lobe = 0; lobe < push.lobes; lobe++) {
                    if (flux[lobe] == vec3(0.0)) continue;
                    for (uint index = 0; index < push.receiver_count; index++) {
                        bool is_lit = push.clustered == 0 ? is_lit_by(patch_, index, clip) : is_close_cluster(patch_, planar_receivers[index]);
                        if (!is_lit) continue;
                        Footprint found[2];
                        uint found_count = project_footprints(clipped, light, clipped_disc, flux[lobe], lobe == 0 ? 0.0 : eta, index, found);
                        uint slot = first_slot + count;
                        if (found_count > 0) footprints[slot] = found[0];
                        if (found_count > 1) footprints[slot + 1] = found[1];
                        count += found_count;
                    }
                }
            }
            clip = push.clustered == 0 ? next_clipping_receiver(patch_, clip + 1) : int(push.receiver_count);
        } while (clip < int(push.receiver_count));
    }
    count_slots(push.pair_count, count);
}
