// project: the image of every light in every patch on every receiver, as a footprint.
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
// 2 lobes receiver_count slots a pair, the used ones first.
layout(std430, binding = 7) writeonly buffer Footprints { Footprint footprints[]; };
layout(std430, binding = 8) writeonly buffer Counts { uint counts[]; };
layout(std430, binding = 9) writeonly buffer GroupCounts { uvec2 group_counts[]; }; // footprints, lit pairs
layout(std430, binding = 10) buffer Coarse { uint coarse[]; }; // by receiver: bit l for footprints in level l
layout(std430, binding = 11) readonly buffer Pairs { uvec2 pairs[]; }; // patch and light, where patches are merged
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
// Footprints of merged patches whose ends are seen at less than this angle, rad, are spread on the plane.
const float MAX_PLANAR_ANGLE = 0.05;

// The part of the plane that rays within the ellipse d^T inverse(m) d <= 1 reach, as (low, high) from
// its centre. To first order they meet the plane at d, by perspective at d / (1 + g.d).
vec4 extent_of(vec3 m, vec2 g) {
    float gg = quadratic2(m, g);
    vec2 mg = vec2(m.x * g.x + m.y * g.y, m.y * g.x + m.z * g.y);
    vec2 discriminant = mg * mg + (1.0 - gg) * m.xz;
    vec2 root = sqrt(max(discriminant, 0.0));
    vec2 a = (-mg - root) / (1.0 - gg);
    vec2 b = (-mg + root) / (1.0 - gg);
    if (gg < 1.0) return vec4(a, b);
    // Some rays never meet the plane; the others reach as far as there is.
    vec2 nearest = mg / (sqrt(gg) * (1.0 + sqrt(gg)));
    vec2 low = mix(vec2(-FAR), max(a, b), greaterThanEqual(nearest, max(a, b)));
    vec2 high = mix(vec2(FAR), min(a, b), lessThanEqual(nearest, min(a, b)));
    bvec2 all_ = lessThan(discriminant, vec2(0.0));
    return vec4(mix(low, vec2(-FAR), all_), mix(high, vec2(FAR), all_));
}

// Footprints that `patch_` throws on receiver number `index`, with `flux` in W: none, one, or two
// where the patch's plane cuts the first. Mirrored light for ratio 0, refracted otherwise.
uint project_footprints(Patch patch_, Light light, LightDisc disc, vec3 flux, float eta, uint index, out Footprint footprints_[2]) {
    PlanarReceiver receiver = planar_receivers[index];
    vec3 m = receiver.normal;
    if (dot(receiver.origin - patch_.position, m) >= 0.0) return 0;
    vec3 normal = normalize(patch_.normal);
    vec3 r = outgoing_direction(disc.direction, normal, eta);
    // The ray must run toward the front of the plane.
    if (dot(r, m) >= -1e-6) return 0;
    // A flat patch images its surroundings as evenly as itself: the wide kernel, whose sum is even to
    // 0.1 %, blurs nothing but the mirror's edge.
    bool is_flat = patch_.normal_du == vec3(0.0) && patch_.normal_dv == vec3(0.0);
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
        // By derivatives, as rays from the ends of a large patch may miss the plane.
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

    // The light's directions become a cone about r; its section with the plane.
    vec3 a, b;
    light_axes(light, disc, a, b);
    a = mean_distance * outgoing_change(disc.direction, normal, a, vec3(0.0), eta);
    b = mean_distance * outgoing_change(disc.direction, normal, b, vec3(0.0), eta);
    mat2 of_light = mat2(
        texel_direction(receiver, a - r * (dot(a, m) / dot(r, m))),
        texel_direction(receiver, b - r * (dot(b, m) / dot(r, m))));
    Kernel kernel = kernel_for(of_patch, of_light, 1.0 / 12.0, is_flat ? SHARPEST : SHARPEST_CURVED);

    // The patch throws its light to one side of its own plane, which cuts the receiver in the line
    // 1 + edge.d = 0. What of the footprint lies beyond is folded back: a second footprint, the
    // first mirrored at the line in the metric of the conic, and both only before the line. That
    // keeps the flux and, where patches end in the line, the evenness of their sum.
    vec3 ahead = from_texels(receiver, centre) - patch_.position;
    vec3 n = cross(patch_.edge1, patch_.edge2) * (eta == 0.0 ? 1.0 : -1.0);
    float before = dot(n, ahead);
    vec2 edge = vec2(
        dot(n, receiver.edge_u) / float(receiver.width),
        -dot(n, receiver.edge_v) / float(receiver.height)) / before;
    bool folded = before > 0.0 && quadratic2(kernel.profile.support * kernel.covariance, edge) > 1.0;

    // A footprint whose standard deviation is 2^l texels or more everywhere goes to level l, where
    // it covers fewer texels. Interpolation adds the variance (4^l - 1)/4, so it is taken off
    // before.
    float variance = min(minor_eigenvalue(kernel.covariance, kernel.determinant), 1e6);
    int level = level_for(receiver, variance);
    Level tile = level_of(receiver, level);
    float scale = 1.0 / float(1 << level);
    vec2 origin = vec2(receiver.tile_x, receiver.tile_y);
    vec2 target_texel = clamp(centre, origin, origin + vec2(receiver.width, receiver.height));
    vec3 target = from_texels(receiver, target_texel);
    centre = vec2(tile.origin) + (centre - origin) * scale;
    kernel = rescaled(kernel, 0.25 * (float(1 << 2 * level) - 1.0), scale);

    // Bounding box; nothing to do where it misses the tile.
    vec2 around = vec2(level > 0 ? 1.0 : 0.0);
    vec2 tile_low = vec2(tile.origin) - around;
    vec2 tile_high = vec2(tile.origin + tile.size) + around;
    vec3 conic = conic_of(kernel);
    vec2 half_size = sqrt(kernel.profile.support * kernel.covariance.xz);
    vec2 low = centre - half_size;
    vec2 high = centre + half_size;
    vec2 box = ceil(high) - floor(low) - 0.5;
    bool is_small = box.x * box.y <= MAX_NORMALISED_TEXELS;

    // What spreads by direction, not by the patch's own size, is wide: d^T conic d <= s^2 is its ellipse.
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

    // Visibility from the patch to the point of the receiver that is nearest to the centre.
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

    // W to W/m^2 in a texel of the level.
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
        // The sky is a matter of light_image where the patch does not touch the receiver.
        bool is_projected = push.clustered == 0;
        for (uint index = 0; index < push.receiver_count && !is_projected; index++) is_projected = is_close_cluster(patch_, planar_receivers[index]);
        uint first_slot = local * 2 * push.lobes * push.receiver_count;
        // The patch on all receivers that leave it whole, then its part before each that cuts it. The triangle of a
        // merged patch stands for another shape, and is not cut.
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
