// pilot chains: follows a ray through every cell of the lattices, along one lobe of every surface, chosen in proportion to its light.
// What lands says how fine the cells are to be.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
OBJECTS(3)
LIGHTS(4)
PLANAR_RECEIVERS(5)
layout(std430, binding = 6) readonly buffer Lattices { ChainLattice lattices[]; };
layout(std430, binding = 7) writeonly buffer PilotRays { PilotRay pilot_rays[]; };
layout(std430, binding = 8) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 9) readonly buffer AtlasNodes { AtlasNode atlas_nodes[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "light_part.glsl"
#include "light_piece.glsl"
#include "media.glsl"
#include "chain_hit.glsl"
#include "planar_receiver.glsl"
#include "kernel.glsl"
#include "chain_ray.glsl"
#include "light_axes.glsl"
#include "chain.glsl"
#include "lattice_ray.glsl"
#include "ray_cells.glsl"
#include "chain_changes.glsl"
#include "light_beam.glsl"
#include "chain_landing.glsl"

// Where a pilot ray ends.
struct PilotEnd {
    vec3 place;
    float blur;   // standard deviation of the light's image and of a texel there, m
};

// The first receiver that the path's light lands on. Returns false where it lands on none. `finest`: spacing of the lattice after all
// refinements over that before.
bool land_on(ChainPath path, ChainHit hit, float finest, inout PilotRay ray, inout PilotEnd end) {
    for (uint index = 0; index < push.receiver_count; index++) {
        PlanarReceiver receiver = planar_receiver_at(index);
        float distance_;
        vec2 place;
        if (!lands_on(path, hit, receiver, distance_, place)) continue;
        ray.flux = dot(flux_after(path, distance_), vec3(1.0 / 3.0));
        ray.receiver = index;
        end.place = path.position + distance_ * path.direction;
        end.blur += sqrt(texel_area(receiver) / 12.0);
        Landing landing;
        if (DISPERSES && land(path, hit, receiver, index, landing)) {
            landing.of_cell *= finest;
            ray.dispersed = dispersion_of(landing);
        }
        return true;
    }
    if (HAS_ATLAS && ends_on_mesh(path, hit)) {
        uint mesh = uint(object_at(triangle_at(hit.triangle).object).receiver);
        ray.flux = dot(flux_after(path, hit.distance), vec3(1.0 / 3.0));
        ray.receiver = push.receiver_count + mesh;
        end.place = path.position + hit.distance * path.direction;
        if (DISPERSES) ray.dispersed = dispersion_on(mesh_receivers[mesh], path, hit, finest);
        return true;
    }
    return false;
}

// Follows a ray to where it lands. Rays with the same `seed` choose the same lobes.
PilotRay follow(ChainPath path, uint seed, float finest, out PilotEnd end) {
    PilotRay ray = PilotRay(0.0, 0, 0, 0.0);
    end = PilotEnd(vec3(0.0), 0.0);
    Light light = part_at(light_at(light_of(path)), path.position);
    float deviation = 0.0; // of the light's directions at the first surface, rad
    for (;;) {
        ChainHit hit = hit_of(path);
        ray.interfaces = interfaces_of(path);
        if (is_first(path)) {
            vec3 a, b;
            light_axes(light, disc_at(light, path.position + hit.distance * path.direction), a, b);
            deviation = max(length(a), length(b));
        } else {
            end.blur += hit.distance * deviation;
            if (land_on(path, hit, finest, ray, end)) break;
        }
        Interaction at;
        if (ray.interfaces >= push.max_interfaces || !interact(path, hit, at)) break;
        Lobe lobe;
        bool refracts;
        if (!choose_lobe(path, at, choice(seed, ray.interfaces), lobe, refracts)) break;
        if (DISPERSES) path = next_path(path, hit, at, transfer_to(path, hit, at), lobe, refracts);
        else path = next_ray(path, hit, at, lobe, refracts);
    }
    if (is_of_chains(path)) ray.interfaces |= IS_CHAIN;
    return ray;
}

// To which extent, from 0 to 1, the rays to both sides of a pilot ray land beside it: their places are `beside` on the lattice, or their directions are
// those of opposite pieces of the light.
float agreement(ChainLattice lattice, vec2 place, vec2 beside, LightPiece piece, uint seed, float finest, PilotRay ray, PilotEnd end) {
    vec3 places[2];
    for (int i = 0; i < 2; i++) {
        float side = i == 0 ? 1.0 : -1.0;
        LightPiece of_side = piece;
        of_side.centre *= side;
        PilotEnd other_end;
        PilotRay other = follow(ray_at(lattice, place + side * beside, uvec2(0), of_side), seed, finest, other_end);
        if (other.interfaces != ray.interfaces || other.flux == 0.0 || other.receiver != ray.receiver) return 0.0;
        places[i] = other_end.place;
    }
    float uneven = 0.5 * length(places[0] + places[1] - 2.0 * end.place);
    return 1.0 - uneven / max(uneven, sqrt(12.0) * end.blur + 0.5 * distance(places[0], places[1]));
}

void main() {
    uint index = thread_index();
    if (index >= push.pilot_count) return;
    LATTICE_OF(number, index)
    ChainLattice lattice = lattices[number];
    uvec2 cell = column_and_row(lattice, index - lattice.first);
    vec2 place = shifted(lattice, vec2(cell) + WITHIN_CELL, uvec2(0));
    float finest = exp2(-float(lattice.refinements));
    PilotEnd end;
    PilotRay ray = follow(ray_at(lattice, place, uvec2(0), WHOLE_LIGHT), index, finest, end);
    // The rays beside it in the refined lattice. Where they take another way, or their ends are not evenly spaced, the footprint of the
    // ray stands for light that lands elsewhere. Along one axis for even cells, and along the other for odd ones.
    vec2 beside = (cell.y + index - lattice.first) % 2 == 0 ? vec2(finest, 0.0) : vec2(0.0, finest);
    vec2 incoherent = vec2(0.0);
    if (is_chain(ray) && ray.flux != 0.0) {
        incoherent.x = 1.0 - agreement(lattice, place, beside, WHOLE_LIGHT, index, finest, ray, end);
        // The same for opposite sides of the disc of a sun or lamp, by turns. The cells of an environment are narrow enough.
        LightPiece piece = WHOLE_LIGHT;
        piece.centre = cell.x % 2 == 0 ? vec2(DISC_RADIUS, 0.0) : vec2(0.0, DISC_RADIUS);
        Light light = light_at(lattice.light);
        if (light.size > 0.0 && light.half_azimuth == 0.0) incoherent.y = 1.0 - agreement(lattice, place, vec2(0.0), piece, index, finest, ray, end);
        // Where neighbouring directions are bent apart smoothly, the disc's image keeps its place and extent to second order.
        incoherent.y *= incoherent.y;
    }
    ray.interfaces = pack_pilot(ray.interfaces, incoherent);
    pilot_rays[index] = ray;
}
