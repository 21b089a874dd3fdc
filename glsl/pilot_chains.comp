// pilot chains: follows the rays of the lattices before their refinement, along one lobe of every surface, chosen in proportion to
// its light. What lands says how fine a lattice is to be.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 64) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
OBJECTS(3)
LIGHTS(4)
PLANAR_RECEIVERS(5)
layout(std430, binding = 6) readonly buffer Lattices { ChainLattice lattices[]; };
layout(std430, binding = 7) readonly buffer Shares { ReceiverShare shares[]; };
layout(std430, binding = 8) writeonly buffer PilotShares { float pilot_shares[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "media.glsl"
#include "chain_hit.glsl"
#include "planar_receiver.glsl"
#include "chain.glsl"

// A receiver with less than this share of all light of single surfaces is judged as if it had so much.
const float DIM_RECEIVER = 0.01;
// Of a ray that meets a second surface, whether it lands or not.
const float CHAINED = 1e-30;

// The light that lands where the ray ends, over the light of single surfaces there.
float landing_share(ChainPath path, ChainHit hit, float all) {
    float share = 0.0;
    for (uint index = 0; index < push.receiver_count; index++) {
        PlanarReceiver receiver = planar_receiver_at(index);
        float distance_;
        vec2 place;
        if (!meets_plane(path, receiver, distance_, place) || distance_ > hit.distance * 1.0001) continue;
        vec2 low = vec2(receiver.tile_x, receiver.tile_y);
        if (any(lessThan(place, low)) || any(greaterThan(place, low + vec2(receiver.width, receiver.height)))) continue;
        vec3 flux = path.flux * exp(-distance_ * filling(path.media).absorption);
        share += dot(flux, vec3(1.0 / 3.0)) / max(max(shares[index].flux, DIM_RECEIVER * all), 1e-30);
    }
    return share;
}

// From 0 to 1, evenly distributed over the rays and over the surfaces of a chain (Roberts 2018).
float choice(uint index, uint interfaces) {
    return fract(0.5 + 0.6180340 * float(index & 0xffffu) + 0.7548777 * float(interfaces));
}

void main() {
    uint index = thread_index();
    if (index >= push.pilot_count) return;
    float all = 0.0;
    for (uint receiver = 0; receiver < push.receiver_count; receiver++) all += shares[receiver].flux;
    ChainLattice lattice = lattice_of(index);
    ChainPath path = ray_of_lattice(lattice, index);
    float share = 0.0;
    for (bool is_first = true;; is_first = false) {
        ChainHit hit = hit_of(path);
        uint interfaces = interfaces_of(path);
        if (interfaces > 1) share += landing_share(path, hit, all);
        Interaction at;
        if (interfaces >= push.max_interfaces || !interact(path, hit, lattice, is_first, at)) break;
        if (!is_first) share = max(share, CHAINED);
        float reflected = at.eta > 0.0 ? at.reflectance.x : 1.0;
        bool refracts = choice(index, interfaces) >= reflected;
        vec3 s = -path.direction;
        Lobe lobe;
        lobe.direction = refracts ? outgoing_direction(s, at.normal, at.eta) : mirrored(s, at.normal);
        lobe.flux = at.flux * (at.eta > 0.0 ? vec3(1.0) : at.reflectance);
        if (!(dot(at.geometric, lobe.direction) * (refracts ? -1.0 : 1.0) > 0.0)) break;
        path = next_ray(path, hit, at, lobe, refracts, is_first);
        if (!(largest(path.flux) >= LEAST_SHARE * path.first_flux)) break;
    }
    pilot_shares[index] = share;
}
