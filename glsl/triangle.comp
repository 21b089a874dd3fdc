// triangle: projects each patch along its corners' outgoing rays onto each planar receiver, as a triangle of constant
// irradiance. The triangles of adjacent patches are adjacent, so that their sum is even.
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
// lobes receiver_count slots per pair; the used slots come first.
layout(std430, binding = 6) writeonly buffer TriangleSplats { TriangleSplat triangle_splats[]; };
layout(std430, binding = 7) writeonly buffer Counts { uint counts[]; };
layout(std430, binding = 8) writeonly buffer GroupCounts { uvec2 group_counts[]; }; // triangles, lit pairs
#include "project_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "kernel.glsl"
#include "flux.glsl"
#include "clip.glsl"
#include "slots.glsl"

// For measurements: triangles take the product of two lengths for their area, see product_over_area().
layout(constant_id = 1) const bool AREA_BY_PRODUCT = false;

// Lower bound on the length and height of a triangle, texels, so that no area is zero.
const float MIN_THICKNESS = 1.0 / 16.0;

// Stretches a triangle that a focus or a fold has made thinner than MIN_THICKNESS: lengthens the longest side, and
// moves the opposite corner away from that side. Orders the corners counter-clockwise: cross2 > 0.
void widen(inout vec2 q[3]) {
    int apex = 0;
    float longest = -1.0;
    for (int i = 0; i < 3; i++) {
        float side = distance(q[(i + 1) % 3], q[(i + 2) % 3]);
        if (side > longest) {
            longest = side;
            apex = i;
        }
    }
    int from = (apex + 1) % 3;
    int to = (apex + 2) % 3;
    vec2 along = longest > 0.0 ? (q[to] - q[from]) / longest : vec2(1.0, 0.0);
    q[to] += max(MIN_THICKNESS - longest, 0.0) * along;
    float height = cross2(along, q[apex] - q[from]);
    float more = max(MIN_THICKNESS - abs(height), 0.0);
    q[apex] += (height < 0.0 ? -more : more) * vec2(-along.y, along.x);
    if (height < 0.0) {
        vec2 last = q[2];
        q[2] = q[1];
        q[1] = last;
    }
}

// Error of a common approximation: length(dFdx(x)) * length(dFdy(x)) over the true area length(cross(dFdx(x),
// dFdy(x))), where x is the position on the caster that lights a texel. The ratio is 1 / sin of the angle between the
// derivatives. `side1` and `side2` are the images of the patch's edges.
float product_over_area(Patch patch_, vec2 side1, vec2 side2) {
    float determinant = cross2(side1, side2);
    vec3 dx = patch_.edge1 * side2.y - patch_.edge2 * side1.y; // times the determinant
    vec3 dy = patch_.edge2 * side1.x - patch_.edge1 * side2.x;
    return length(dx) * length(dy) / (length(cross(patch_.edge1, patch_.edge2)) * abs(determinant));
}

// Projects `patch_` with `flux`, W, onto a receiver. Returns false where no light arrives. eta = 0: reflected light;
// otherwise refracted.
bool project_triangle(Patch patch_, Light light, vec3 flux, float eta, PlanarReceiver receiver, out TriangleSplat splat) {
    vec3 m = receiver.normal;
    if (dot(receiver.origin - patch_.position, m) >= 0.0) return false;
    vec2 q[3];
    for (int i = 0; i < 3; i++) {
        vec2 st = CORNERS[i];
        vec3 x = patch_.position + st.x * patch_.edge1 + st.y * patch_.edge2;
        vec3 n = normalize(patch_.normal + st.x * patch_.normal_du + st.y * patch_.normal_dv);
        vec3 r = outgoing_direction(disc_at(light, x).direction, n, eta);
        float along = dot(r, m);
        // The ray must travel toward the plane's front.
        if (along >= -1e-6) return false;
        q[i] = to_texels(receiver, x + dot(receiver.origin - x, m) / along * r);
    }
    widen(q);

    vec2 tile_low = vec2(receiver.tile_x, receiver.tile_y);
    vec2 tile_high = tile_low + vec2(receiver.width, receiver.height);
    vec2 lower = clamp(floor(min(min(q[0], q[1]), q[2])), tile_low, tile_high);
    vec2 upper = clamp(ceil(max(max(q[0], q[1]), q[2])), tile_low, tile_high);
    if (!all(lessThan(lower, upper))) return false;

    // Visibility from the patch to the receiver's point nearest to the triangle's centroid.
    vec3 target = from_texels(receiver, clamp((q[0] + q[1] + q[2]) / 3.0, tile_low, tile_high));
    if (push.can_occlude != 0 && occluded(patch_.position, target - patch_.position, SHADOW_RAY_END, patch_.triangle)) return false;

    float area = 0.5 * cross2(q[1] - q[0], q[2] - q[0]);
    vec3 irradiance = flux / (area * texel_area(receiver));
    if (AREA_BY_PRODUCT) irradiance *= product_over_area(patch_, q[1] - q[0], q[2] - q[0]);
    splat = TriangleSplat(irradiance, 0.0, q[0], q[1], q[2], lower, upper, vec2(0.0));
    return true;
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    uint count = 0;
    if (local < push.pair_count) {
        uint pair = push.first_pair + local;
        Patch patch_ = patches[pair % push.patch_count];
        Light light = lights[push.first_light + pair / push.patch_count];
        LightDisc disc = disc_at(light, patch_.position);
        float eta = orient_toward(patch_, disc.direction);
        uint first_slot = local * push.lobes * push.receiver_count;
        // The whole patch lights all receivers that do not clip it, then the clipped patch lights each receiver that
        // clips it.
        uint clip = push.receiver_count;
        uint next = 0;
        do {
            Patch clipped = patch_;
            if (clip < push.receiver_count) clipped = clipped_patch(patch_, planar_receivers[clip]);
            vec3 flux[2];
            if (flux_of(clipped, light, disc_at(light, clipped.position), eta, flux)) {
                for (uint lobe = 0; lobe < push.lobes; lobe++) {
                    if (flux[lobe] == vec3(0.0)) continue;
                    for (uint index = 0; index < push.receiver_count; index++) {
                        if (!is_lit_by(patch_, index, clip)) continue;
                        TriangleSplat splat;
                        if (project_triangle(clipped, light, flux[lobe], lobe == 0 ? 0.0 : eta, planar_receivers[index], splat)) triangle_splats[first_slot + count++] = splat;
                    }
                }
            }
            clip = next_clipping_receiver(patch_, next);
            next = clip + 1;
        } while (clip < push.receiver_count);
    }
    count_slots(push.pair_count, count);
}
