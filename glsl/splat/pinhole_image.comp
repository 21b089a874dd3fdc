// pinhole_image: projects environment cells by patch clusters, reflected and refracted, onto the receivers that a
// cluster is not close to. The cluster is a pinhole camera (Wand & Strasser 2003, section 3.1). The edges of the image
// are blurred according to the size and the curvature of the cluster.
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
// lobes^2 receiver_count slots per pair; the used slots come first.
layout(std430, binding = 6) writeonly buffer PinholeImages { PinholeImage pinhole_images[]; };
layout(std430, binding = 7) writeonly buffer Counts { uint counts[]; };
layout(std430, binding = 8) writeonly buffer GroupCounts { uvec2 group_counts[]; }; // images, lit pairs
layout(std430, binding = 9) buffer Coarse { uint coarse[]; }; // per receiver: bit l is set where images are in level l
layout(std430, binding = 10) readonly buffer Pairs { uvec2 pairs[]; }; // patch cluster and environment cell
CLUSTER_STARTS_OF(11)
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "kernel.glsl"
#include "flux.glsl"
#include "above.glsl"
#include "cluster.glsl"
#include "cluster_light.glsl"
#include "slots.glsl"

// Half width of the blur kernel (1 - x^2)^2 over its standard deviation.
const float SOFT = sqrt(7.0);
// Half range of azimuths, rad, beyond which an image is not bounded.
const float MAX_BOUNDED_AZIMUTH = 1.2;
// Sine of elevation beyond which a cell is treated as ending at a pole.
const float POLE = 0.9999;
// Maximum width of a coarse level's texel over the standard deviation of the blur's narrower axis.
const float COARSE_TEXEL = 2.0;

// Whether the cell also extends behind the patch, which faces the cell's centre.
bool is_on_both_sides(Patch patch_, Light light) {
    Cell cell = cell_of(light);
    vec3 normal = cross(patch_.edge1, patch_.edge2);
    float least = FAR;
    for (int i = 0; i < 9; i++) least = min(least, dot(toward(cell, vec2(i % 3 - 1, i / 3 - 1)), normal));
    return least < 0.0;
}

// The reflected image or, with `refracts`, the refracted image on the receiver `index`. Returns false where there is
// none. `eta` is the index of refraction before the patch over the index behind it, 0 for a mirror. `side` is -1 where
// the patch was turned.
bool project_image(Patch patch_, float side, Light light, float eta, bool refracts, uint index, uvec2 members, out PinholeImage image) {
    float lobe_eta = refracts ? eta : 0.0;
    PlanarReceiver receiver = planar_receiver_at(index);
    if (is_close_cluster(patch_, receiver)) return false;
    vec3 m = receiver.normal;
    float height = dot(patch_.position - receiver.origin, m);
    if (height <= 0.0) return false;
    vec3 normal = normalize(patch_.normal);

    Cell cell = cell_of(light);
    vec2 point = pair_point(members);
    OutgoingLight outgoing;
    if (!outgoing_light(patch_, cell, eta, refracts, receiver, point.x, outgoing)) return false;
    vec3 middle = outgoing.toward;
    vec3 r = outgoing_direction(middle, normal, lobe_eta);
    if (r == vec3(0.0)) return false;
    // The mean of a wide cell may leave away from the receiver.
    r = normalize(r - max(dot(r, m) + GRAZING, 0.0) * m);
    float range = refracts ? 0.0 : range_along(normal_change_of(patch_), normal, middle);
    float path = height / -dot(r, m);

    mat2 of_patch = cluster_image(patch_, middle, normal, lobe_eta, receiver, r, path) * sqrt(push.spread);
    vec3 covariance = outer2(of_patch[0]) + outer2(of_patch[1]);

    // Level choice as for footprints, but here the kernel blurs an edge.
    float determinant = cross2(of_patch[0], of_patch[1]);
    float minor = minor_eigenvalue(covariance, determinant * determinant);
    SplatLevel target = splat_level(receiver, min(COARSE_TEXEL * COARSE_TEXEL * minor, 1e6));
    int level = target.level;
    float scale = target.scale;
    covariance = covariance * (scale * scale) + (1.0 / 12.0 - 0.25 * (1.0 - scale * scale)) * vec3(1.0, 0.0, 1.0);
    vec2 foot = place_on(target, to_texels(receiver, patch_.position));

    // The cell's axes as the patch reflects or refracts them. In these axes the direction to a texel is linear in the
    // texel; refraction adds a component along the normal, see normal_coefficient().
    vec3 u = receiver.edge_u / (float(receiver.width) * scale * height);
    vec3 v = -receiver.edge_v / (float(receiver.height) * scale * height);
    vec3 ahead = cell.ahead;
    vec3 east = cell.east;
    vec3 up = vec3(0.0, 1.0 / cell.half_sine, 0.0);
    vec3 cosine = normal;
    vec3 along_normal = vec3(0.0);
    if (refracts) {
        along_normal = vec3(dot(ahead, normal), dot(east, normal), dot(up, normal));
        ahead /= -lobe_eta;
        east /= -lobe_eta;
        up /= -lobe_eta;
        cosine = -normal;
    } else {
        ahead = mirrored(ahead, normal);
        east = mirrored(east, normal);
        up = mirrored(up, normal);
    }

    // Derivatives of the coordinates by the texel at the mean direction, and from them the blur of the edges. Where the
    // blur of the two coordinates is correlated, the second one's blur is what remains after the correlated part is
    // sheared away.
    float at = dot(cosine, r);
    float normal_part = refracts ? normal_coefficient(at, lobe_eta) : 0.0;
    float normal_part_change = refracts ? at / (lobe_eta * lobe_eta * normal_part + lobe_eta * at) - 1.0 / lobe_eta : 0.0;
    float forward = dot(ahead, r) + along_normal.x * normal_part;
    float sideward = dot(east, r) + along_normal.y * normal_part;
    float nearness = 1.0 / (cell.half_azimuth * max(forward * forward + sideward * sideward, 1e-6));
    vec2 du, dv;
    for (int i = 0; i < 2; i++) {
        vec3 texel = i == 0 ? u : v;
        vec3 turn = (texel - r * dot(r, texel)) * (height / path);
        float more = normal_part_change * dot(cosine, turn);
        vec3 change = vec3(dot(ahead, turn), dot(east, turn), dot(up, turn)) + along_normal * more;
        du[i] = (forward * change.y - sideward * change.x) * nearness;
        dv[i] = change.z;
    }
    vec3 blur = vec3(
        quadratic2(covariance, du),
        covariance.x * du.x * dv.x + covariance.y * (du.x * dv.y + du.y * dv.x) + covariance.z * du.y * dv.y,
        quadratic2(covariance, dv));
    // An unblurred box has the variance 1/3. Only a wider blur rounds the corners.
    float share = blur.x / (blur.x + 1.0 / 3.0);
    float shear = clamp(blur.y / (blur.x + 1.0 / 3.0) * share, -1e3, 1e3);
    vec2 soft = SOFT * sqrt(max(vec2(blur.x, blur.z - shear * blur.y), 1e-8));
    // The blur reaches around the vertical at most once.
    soft.x = min(soft.x, PI / cell.half_azimuth - 1.0 + 1e-4);

    // Nothing lies beyond the poles, so edges at the poles stay sharp.
    float low_sine = cell.sine - cell.half_sine;
    float high_sine = cell.sine + cell.half_sine;
    float margin = soft.y * cell.half_sine;
    if (low_sine < -POLE) low_sine = -1.0 - margin;
    if (high_sine > POLE) high_sine = 1.0 + margin;
    float rescale = 2.0 * cell.half_sine / (high_sine - low_sine);
    up *= rescale;
    along_normal.z *= rescale;
    shear *= rescale;
    soft.y *= rescale;
    cell.sine = 0.5 * (low_sine + high_sine);
    cell.half_sine = 0.5 * (high_sine - low_sine);

    // Bounds of the image: the images of directions around its border. Directions below a horizon are moved back to the
    // horizon.
    vec2 edge = 1.0 + soft;
    edge.y += abs(shear) * edge.x;
    vec2 low = vec2(FAR);
    vec2 high = vec2(-FAR);
    // The points must not lie too far apart.
    if (edge.x * cell.half_azimuth > MAX_BOUNDED_AZIMUTH) {
        low = vec2(-FAR);
        high = vec2(FAR);
    }
    vec2 inside = vec2(dot(middle, normal) + range, -dot(r, m)) - 0.1 * GRAZING;
    for (int i = 0; i < 10; i++) {
        vec3 s = toward(cell, edge * vec2(0.5 * float(i % 5) - 1.0, i < 5 ? -1.0 : 1.0));
        float outside = dot(s, normal) + range - 0.1 * GRAZING;
        if (outside < 0.0) s = mix(middle, s, inside.x / (inside.x - outside));
        s = outgoing_direction(lobe_eta > 0.0 ? normalize(s) : s, normal, lobe_eta);
        if (s == vec3(0.0)) {
            // Total reflection: the image is unbounded.
            low = vec2(-FAR);
            high = vec2(FAR);
            break;
        }
        outside = -dot(s, m) - 0.1 * GRAZING;
        if (outside < 0.0) s = mix(r, s, inside.y / (inside.y - outside));
        vec2 place = texel_direction(receiver, s * (height / max(-dot(s, m), 1e-6))) * scale;
        low = min(low, place);
        high = max(high, place);
    }
    vec2 tile_low, tile_high;
    level_bounds(target.tile, level, tile_low, tile_high);
    low = clamp(foot + low, tile_low, tile_high);
    high = clamp(foot + high, tile_low, tile_high);
    if (!all(lessThan(low, high)) || !arrives(members.x, side, outgoing.ray, lobe_eta, receiver, point.y)) return false;

    if (level > 0) atomicOr(coarse[index], 1u << level);

    vec3 radiance = light.power / (4.0 * light.half_azimuth * light.half_sine);
    Object object = object_at(patch_.object);
    // The Fresnel factor is evaluated per texel, because it varies strongly with the angle. Refracted radiance scales
    // with the square of the index.
    if (eta == 0.0) {
        radiance *= reflected_share(object, mean_above(dot(middle, normal), range), eta);
    } else if (refracts) {
        radiance /= lobe_eta * lobe_eta;
    }
    float image_eta = refracts ? lobe_eta : eta > 0.0 ? 1.0 / eta : 1.0;
    image = PinholeImage(
        foot, low, high, vec2(dot(u, u), dot(v, v)),
        vec3(dot(ahead, u), dot(ahead, v), -dot(ahead, m)), 1.0 / soft.x,
        vec3(dot(east, u), dot(east, v), -dot(east, m)), 1.0 / soft.y,
        vec3(dot(up, u), dot(up, v), -dot(up, m)), packHalf2x16(vec2(shear, min(range, 1e4))),
        vec3(dot(cosine, u), dot(cosine, v), -dot(cosine, m)), cell.sine / cell.half_sine,
        radiance * (patch_.area / (height * height)), image_eta, along_normal, cell.half_azimuth);
    return true;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uvec2 members = pairs[push.first_pair + local];
        Patch patch_ = patches[members.x];
        Light light = light_at(members.y);
        uint first_slot = local * push.lobes * push.lobes * push.receiver_count;
        // The part of the cell on the light's side of the patch; for a dielectric with light on both sides, then the
        // part on the other side.
        float lobe_eta = orient_toward(patch_, light.place);
        float side = dot(patch_.normal, patches[members.x].normal) < 0.0 ? -1.0 : 1.0;
        bool is_other = false;
        bool has_other = lobe_eta > 0.0 && is_on_both_sides(patch_, light);
        do {
            if (is_other) {
                vec3 other_side = -cross(patch_.edge1, patch_.edge2);
                patch_ = patches[members.x];
                lobe_eta = orient_toward(patch_, other_side);
                side = -side;
            }
            for (uint lobe = 0; lobe < (lobe_eta > 0.0 ? 2 : 1); lobe++) {
                for (uint index = 0; index < push.receiver_count; index++) {
                    PinholeImage image;
                    if (project_image(patch_, side, light, lobe_eta, lobe == 1, index, members, image)) pinhole_images[first_slot + count++] = image;
                }
            }
            is_other = !is_other;
        } while (is_other && has_other);
    }
    count_slots(push.pair_count, count);
}
