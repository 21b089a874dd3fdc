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

// Rays of a cell: the pilot ray, and two pairs whose ends are to be at the same distances to both sides of its end.
const int PILOT = 0;
const int FIRST_BESIDE = 1;   // beside it in the refined lattice
const int FIRST_OF_LIGHT = 3; // from opposite pieces of the light
const int LAST_RAY = 4;

// To which extent, from 0 to 1, the ends of a pair do not stand for what is between them.
float unevenness(vec3 first, vec3 second, PilotEnd end) {
    float uneven = 0.5 * length(first + second - 2.0 * end.place);
    return uneven / max(uneven, sqrt(12.0) * end.blur + 0.5 * distance(first, second));
}

void main() {
    uint index = thread_index();
    if (index >= push.pilot_count) return;
    LATTICE_OF(number, index)
    ChainLattice lattice = lattices[number];
    uvec2 cell = column_and_row(lattice, index - lattice.first);
    vec2 place = shifted(lattice, vec2(cell) + WITHIN_CELL, uvec2(0));
    float finest = exp2(-float(lattice.refinements));
    // The rays beside it in the refined lattice. Where they take another way, or their ends are not evenly spaced, the footprint of the
    // ray stands for light that lands elsewhere. Along one axis for even cells, and along the other for odd ones.
    vec2 beside = (cell.y + index - lattice.first) % 2 == 0 ? vec2(finest, 0.0) : vec2(0.0, finest);
    // The same for opposite sides of the disc of a sun or lamp, by turns. The cells of an environment are narrow enough.
    vec2 of_light = cell.x % 2 == 0 ? vec2(DISC_RADIUS, 0.0) : vec2(0.0, DISC_RADIUS);
    Light light = light_at(lattice.light);
    int last = light.size > 0.0 && light.half_azimuth == 0.0 ? LAST_RAY : FIRST_OF_LIGHT - 1;
    PilotRay ray;
    PilotEnd end;
    vec3 first;
    vec2 incoherent = vec2(0.0);
    // One loop: a call for every kind of ray would make the shader three times as large.
    for (int which = PILOT; which <= last; which++) {
        bool opens_pair = which % 2 == 1;
        float side = opens_pair ? 1.0 : -1.0;
        vec2 at = place;
        LightPiece piece = WHOLE_LIGHT;
        if (which >= FIRST_OF_LIGHT) piece.centre = side * of_light;
        else if (which >= FIRST_BESIDE) at += side * beside;
        PilotEnd other_end;
        PilotRay other = follow(ray_at(lattice, at, uvec2(0), piece), index, finest, other_end);
        if (which == PILOT) {
            ray = other;
            end = other_end;
            if (!is_chain(ray) || ray.flux == 0.0) break;
            continue;
        }
        int pair = which < FIRST_OF_LIGHT ? 0 : 1;
        bool agrees = other.interfaces == ray.interfaces && other.flux != 0.0 && other.receiver == ray.receiver;
        if (!agrees) {
            incoherent[pair] = 1.0;
            if (opens_pair) which++;
        } else if (opens_pair) {
            first = other_end.place;
        } else {
            incoherent[pair] = unevenness(first, other_end.place, end);
        }
    }
    // Where neighbouring directions are bent apart smoothly, the disc's image keeps its place and extent to second order.
    incoherent.y *= incoherent.y;
    ray.interfaces = pack_pilot(ray.interfaces, incoherent);
    pilot_rays[index] = ray;
}
