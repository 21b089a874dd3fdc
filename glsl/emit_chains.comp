// emit chains: writes the branches of a wave of chains as the next wave, and the footprints where they land.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 64) in;
TRIANGLES(0)
NORMALS(1)
OBJECTS(2)
LIGHTS(3)
PLANAR_RECEIVERS(4)
layout(std430, binding = 5) readonly buffer Lattices { ChainLattice lattices[]; };
layout(std430, binding = 6) readonly buffer Paths { ChainPath paths[]; };
layout(std430, binding = 7) readonly buffer Hits { ChainHit hits[]; };
layout(std430, binding = 8) readonly buffer Numbers { uvec2 numbers[]; };      // prefix sums
layout(std430, binding = 9) readonly buffer BlockSums { uvec2 block_sums[]; };
layout(std430, binding = 10) readonly buffer Waves { uint waves[]; };
layout(std430, binding = 11) writeonly buffer NextPaths { ChainPath next_paths[]; };
layout(std430, binding = 12) writeonly buffer Footprints { Footprint footprints[]; };
layout(std430, binding = 13) buffer Coarse { uint coarse[]; };
layout(std430, binding = 14) readonly buffer Profiles { Profile profiles[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "media.glsl"
#include "planar_receiver.glsl"
#include "kernel_fit.glsl"
#include "light_axes.glsl"
#include "chain.glsl"

// The path of a branch: its changes by the transfer to the surface, and by reflection or refraction there.
ChainPath next_path(ChainPath path, ChainHit hit, Met met, Branch branch, bool refracts, uint ray, bool is_first) {
    Triangle triangle = triangle_at(hit.triangle);
    Normals corner = normals_at(hit.triangle);
    vec3 d = path.direction;
    Changes changes = changes_of(path);
    float along = dot(d, met.geometric);
    vec3 n0 = (1.0 - hit.barycentric.x - hit.barycentric.y) * corner.n0 + hit.barycentric.x * corner.n1 + hit.barycentric.y * corner.n2;
    bool is_smooth = met.normal != met.geometric;
    float e11 = dot(triangle.edge1, triangle.edge1);
    float e12 = dot(triangle.edge1, triangle.edge2);
    float e22 = dot(triangle.edge2, triangle.edge2);
    float determinant = e11 * e22 - e12 * e12;
    vec3 s = -d;
    if (is_first) {
        // Over the light, its directions at one place of the first surface.
        Light light = light_at(lattices[lattice_of(ray)].light);
        LightDisc disc = disc_at(light, path.position + hit.distance * d);
        light_axes(light, disc, changes.direction[2], changes.direction[3]);
        // Toward the light; the path goes the other way.
        changes.direction[2] = -changes.direction[2];
        changes.direction[3] = -changes.direction[3];
    }
    for (int i = 0; i < 4; i++) {
        vec3 place = changes.place[i] + hit.distance * changes.direction[i];
        if (is_first && i >= 2) place = vec3(0.0);
        place -= d * (dot(place, met.geometric) / along);
        changes.place[i] = place;
        vec3 dn = vec3(0.0);
        if (is_smooth) {
            float p1 = dot(place, triangle.edge1);
            float p2 = dot(place, triangle.edge2);
            vec2 uv = vec2(p1 * e22 - p2 * e12, p2 * e11 - p1 * e12) / determinant;
            dn = normalize_change(n0, uv.x * (corner.n1 - corner.n0) + uv.y * (corner.n2 - corner.n0)) * met.side;
        }
        changes.direction[i] = outgoing_change(s, met.normal, -changes.direction[i], dn, refracts ? met.eta : 0.0);
    }
    ChainPath next;
    next.position = path.position + hit.distance * d;
    next.triangle = hit.triangle;
    next.direction = branch.direction;
    next.first_flux = path.first_flux;
    if (is_first) next.first_flux *= max(max(met.flux.x, met.flux.y), met.flux.z) / max(max(path.flux.x, path.flux.y), path.flux.z);
    next.flux = branch.flux;
    next.counts = path.counts + 1;
    next.media = refracts ? met.behind : met.before;
    next.unused = uvec2(0);
    if (branch.is_weak) {
        next.counts += 1 << 8;
        for (int i = 0; i < 2; i++) {
            changes.place[i] *= 2.0;
            changes.direction[i] *= 2.0;
        }
    }
    set_changes(next, changes);
    return next;
}

// The footprint of a landing with `flux`, W, on receiver number `index`.
Footprint footprint_of(Landing landing, vec3 flux, PlanarReceiver receiver, uint index) {
    Kernel kernel = kernel_for(landing.of_cell, landing.of_light, 1.0 / 12.0, SHARPEST_CURVED);
    float variance = min(minor_eigenvalue(kernel.covariance, kernel.determinant), 1e6);
    int level = level_for(receiver, variance);
    Level tile = level_of(receiver, level);
    float scale = 1.0 / float(1 << level);
    vec2 centre = vec2(tile.origin) + (landing.centre - vec2(receiver.tile_x, receiver.tile_y)) * scale;
    kernel = rescaled(kernel, 0.25 * (float(1 << 2 * level) - 1.0), scale);
    vec2 tile_low, tile_high;
    level_bounds(tile, level, tile_low, tile_high);
    vec3 conic = conic_of(kernel);
    vec2 half_size = sqrt(kernel.profile.support * kernel.covariance.xz);
    vec2 low = clamp(centre - half_size, tile_low, tile_high);
    vec2 high = clamp(centre + half_size, tile_low, tile_high);
    if (level > 0) atomicOr(coarse[index], 1u << level);
    float peak = peak_of(kernel);
    vec3 irradiance = flux * (scale * scale * peak / texel_area(receiver));
    if (!(kernel.determinant > 0.0)) high = low;

    // A small footprint is normalised over its texels.
    vec2 box = ceil(centre + half_size) - floor(centre - half_size) - 0.5;
    if (box.x * box.y <= MAX_NORMALISED_TEXELS) {
        vec2 first = floor(centre - half_size) + 0.5;
        float sum = 0.0;
        for (float y = 0.0; y < box.y; y += 1.0) {
            for (float x = 0.0; x < box.x; x += 1.0) {
                sum += kernel_value(kernel.profile.flatness, quadratic2(conic, first + vec2(x, y) - centre));
            }
        }
        if (sum > 0.0) irradiance /= sum * peak;
    }
    return Footprint(centre, vec2(0.0), conic, kernel.profile.flatness, irradiance, 0.0, vec3(0.0, 0.0, 1.0), 0.0, low, high);
}

void main() {
    uint index = thread_index();
    if (index >= waves[6]) return;
    bool is_first = push.is_first != 0;
    // Not `?:`, which glslc compiles wrongly for structs in buffers.
    ChainPath path;
    if (is_first) path = ray_of_lattice(index); else path = paths[index];
    ChainHit hit = hits[index];
    uvec2 place = numbers[index] + block_sums[index / SPLAT_GROUP];
    place.y += waves[7];

    Met met;
    if (interfaces_of(path) < push.max_interfaces && meet(path, hit, index, is_first, met)) {
        Branch branches[2];
        branches_of(path, met, branches);
        for (int i = 0; i < 2; i++) {
            if (!branches[i].is_followed || place.x >= push.path_capacity) continue;
            next_paths[place.x++] = next_path(path, hit, met, branches[i], i == 1, index, is_first);
        }
    }
    if (interfaces_of(path) > 1) {
        Medium medium = filling(path.media);
        for (uint receiver = 0; receiver < push.receiver_count; receiver++) {
            PlanarReceiver planar = planar_receiver_at(receiver);
            Landing landing;
            if (place.y >= push.splat_capacity || !land(path, hit, planar, receiver, landing)) continue;
            vec3 flux = path.flux * exp(-landing.distance_ * medium.absorption);
            footprints[place.y++] = footprint_of(landing, flux, planar, receiver);
        }
    }
}
