// pinhole: the paper's gather (Wand & Strasser 2003, sections 3.2 and 3.3). Every patch is a pinhole camera. Each texel
// looks up the light in the direction that the patch reflects or refracts to it, blurred by the curvature of the patch.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
TRIANGLES(0)
NODES(1)
OBJECTS(2)
LIGHTS(3)
PLANAR_RECEIVERS(4)
layout(std430, binding = 5) readonly buffer Patches { Patch patches[]; };
layout(std430, binding = 6) readonly buffer Profiles { Profile profiles[]; };
layout(binding = 7) uniform sampler2D environment;
layout(binding = 8, rgba32f) uniform image2D light_map;
layout(std430, binding = 9) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 10) readonly buffer AtlasTexels { AtlasTexel atlas_texels[]; };
layout(std430, binding = 11) readonly buffer AtlasSamples_ { AtlasSamples atlas_samples[]; };
layout(push_constant) uniform PinholePush {
    uvec2 first;         // first texel of this rectangle in the receiver's tile
    uint receiver;
    uint first_patch;    // first patch of this batch
    uint batch_patches;
    uint light_count;
    float epsilon;       // of the form factor, in squared diameters of the patch
    float spread;        // variance of the filter over the variance of the patch; 0: no filter
    float rotation;      // of the environment
    uint has_environment;
    uint can_occlude;
    uint is_mesh;      // 1: the receiver is a mesh
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "atlas_samples.glsl"
#include "kernel_fit.glsl"
#include "environment.glsl"
#include "flux.glsl"

// Mean radiance of the environment around w, sampled along the long axis of the filter.
vec3 filtered_environment(vec3 w, vec3 a, vec3 b, vec3 covariance) {
    float middle = 0.5 * (covariance.x + covariance.z);
    float radius = length(vec2(0.5 * (covariance.x - covariance.z), covariance.y));
    float major = sqrt(max(middle + radius, 0.0));
    float minor = sqrt(max(middle - radius, 0.0));
    vec2 axis = abs(covariance.y) > 1e-12 * middle ? normalize(vec2(covariance.y, middle + radius - covariance.x))
        : (covariance.x >= covariance.z ? vec2(1, 0) : vec2(0, 1));
    // A box of height h has the standard deviation h / sqrt(12).
    const float BOX = sqrt(12.0);
    int taps = clamp(int(ceil(major / max(minor, 1e-6))), 1, MAX_TAPS);
    float level = environment_level(BOX * max(minor, major / float(taps)));
    vec3 sum = vec3(0.0);
    for (int i = 0; i < taps; i++) {
        float offset = ((float(i) + 0.5) / float(taps) - 0.5) * BOX * major;
        vec3 direction = normalize(w + offset * (axis.x * a + axis.y * b));
        sum += environment_radiance(direction, push.rotation, level);
    }
    return sum / float(taps);
}

// A root of (j1 j1^T + j2 j2^T - (j1 j2^T + j2 j1^T) / 2) / 18, the covariance of a patch whose edges are mapped to j1
// and j2, times the spread of the filter.
mat2 root_of(vec2 j1, vec2 j2) {
    return sqrt(push.spread / 18.0) * mat2(0.5 * (j1 + j2), sqrt(0.75) * (j1 - j2));
}

// Irradiance at y (normal m) from a patch that faces y, W/m^2. The light is reflected, or with `refracts` it comes from
// a medium whose index is 1/eta of the index on y's side. `seen` is a point of the surface next to y, because y may lie
// slightly below the surface.
vec3 gather(Patch p, vec3 y, vec3 seen, vec3 m, bool refracts, float eta) {
    vec3 n = normalize(p.normal);
    vec3 geometric = cross(p.edge1, p.edge2);
    float lobe_eta = refracts ? eta : 0.0;
    vec3 to_receiver = y - p.position;
    float square = dot(to_receiver, to_receiver);
    if (square == 0.0) return vec3(0.0);
    float d = sqrt(square);
    vec3 v = to_receiver / d;
    float cos_x = dot(n, v);
    float cos_y = -dot(m, v);
    vec3 w = outgoing_direction(v, n, lobe_eta);
    bool is_facing = cos_x > 0.0 && cos_y > 0.0 && dot(geometric, v) > 0.0
        && dot(geometric, w) * (refracts ? -1.0 : 1.0) > 0.0;
    if (!is_facing) return vec3(0.0);

    // Change of w over the patch, seen from y, in two axes across w, and the covariance.
    vec3 a, b;
    basis(w, a, b);
    vec3 dv1 = normalize_change(to_receiver, -p.edge1);
    vec3 dv2 = normalize_change(to_receiver, -p.edge2);
    vec3 dw1 = outgoing_change(v, n, dv1, normalize_change(p.normal, p.normal_du), lobe_eta);
    vec3 dw2 = outgoing_change(v, n, dv2, normalize_change(p.normal, p.normal_dv), lobe_eta);
    vec2 j1 = vec2(dot(dw1, a), dot(dw1, b));
    vec2 j2 = vec2(dot(dw2, a), dot(dw2, b));
    mat2 of_patch = root_of(j1, j2);

    vec3 radiance = vec3(0.0);
    for (uint i = 0; i < push.light_count; i++) {
        Light light = light_at(i);
        LightDisc disc = disc_at(light, p.position);
        if (!(dot(w, disc.direction) > 0.0)) continue;
        vec3 off = disc.direction - w;
        vec2 place = vec2(dot(off, a), dot(off, b));
        float radius = max(sin(disc.angular_radius), 1e-5);
        float value;
        if (push.spread > 0.0) {
            mat2 of_pair = of_patch;
            if (disc.inverse_distance > 0.0) {
                // The direction to a lamp also changes over the patch: the filter is that of s - w.
                vec3 ds1 = normalize_change(light.place - p.position, -p.edge1);
                vec3 ds2 = normalize_change(light.place - p.position, -p.edge2);
                of_pair = root_of(j1 - vec2(dot(ds1, a), dot(ds1, b)), j2 - vec2(dot(ds2, a), dot(ds2, b)));
            }
            Kernel kernel = kernel_for(of_pair, mat2(0.5 * radius), 0.0, SHARPEST_CURVED);
            value = peak_of(kernel) * kernel_value(kernel.profile.flatness, quadratic2(conic_of(kernel), place));
        } else {
            value = dot(place, place) < radius * radius ? 1.0 / (PI * radius * radius) : 0.0;
        }
        if (value > 0.0 && (push.can_occlude == 0 || !occluded(p.position, disc.direction, distance_to_light(light, p.position, disc.direction), p.triangle))) {
            radiance += light.power * (disc.falloff * value);
        }
    }
    if (push.has_environment != 0 && (push.can_occlude == 0 || !occluded(p.position, w, FAR, p.triangle))) {
        radiance += filtered_environment(w, a, b, covariance_of(of_patch));
    }
    if (radiance == vec3(0.0)) return radiance;
    if (push.can_occlude != 0 && occluded(p.position, seen - p.position, SHADOW_RAY_END, p.triangle)) return vec3(0.0);

    // Squared diameter of the disc with the patch's area.
    float epsilon = push.epsilon * 4.0 * p.area / PI;
    vec3 share = reflected_share(object_at(p.object), cos_x, eta);
    // Radiance scales with the square of the index.
    if (refracts) share = (1.0 - share) * eta * eta;
    return radiance * share * (p.area * cos_x * cos_y / (square + epsilon));
}

void main() {
    uvec2 texel = push.first + gl_GlobalInvocationID.xy;
    ivec2 place;
    vec3 y, seen, m;
    if (push.is_mesh != 0) {
        MeshReceiver receiver = mesh_receivers[push.receiver];
        if (texel.x >= receiver.width || texel.y >= receiver.height) return;
        uint index = receiver.first_texel + texel.x + texel.y * receiver.width;
        m = atlas_texels[index].normal;
        if (atlas_texels[index].area == 0.0) return;
        place = ivec2(texel + uvec2(receiver.tile_x, receiver.tile_y));
        y = atlas_texels[index].position;
        // The nearest of the points on the triangles.
        AtlasSamples points = atlas_samples[index];
        float best = FAR;
        for (int i = 0; i < 4; i++) {
            if (points.triangles[i] == NO_TRIANGLE) continue;
            vec3 point = sample_point(points, i);
            float away = distance(point, y);
            if (away < best) seen = point;
            best = min(best, away);
        }
    } else {
        PlanarReceiver receiver = planar_receiver_at(push.receiver);
        if (texel.x >= receiver.width || texel.y >= receiver.height) return;
        place = ivec2(texel + uvec2(receiver.tile_x, receiver.tile_y));
        y = from_texels(receiver, vec2(place) + 0.5);
        seen = y;
        m = receiver.normal;
    }
    vec3 sum = vec3(0.0);
    for (uint i = push.first_patch; i < push.first_patch + push.batch_patches; i++) {
        Patch p = patches[i];
        float eta = orient_toward(p, y - p.position);
        sum += gather(p, y, seen, m, false, eta);
        if (eta > 0.0) sum += gather(p, y, seen, m, true, eta);
    }
    vec4 previous = imageLoad(light_map, place);
    imageStore(light_map, place, previous + vec4(sum, 0.0));
}
