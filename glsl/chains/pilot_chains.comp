// pilot chains: follows the rays of the lattices before their refinement, along one lobe of every surface, chosen in proportion to
// its light. What lands says how fine a lattice is to be.
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
#include "media.glsl"
#include "chain_hit.glsl"
#include "planar_receiver.glsl"
#include "chain_ray.glsl"
#include "light_axes.glsl"
#include "chain.glsl"
#include "lattice_ray.glsl"
#include "chain_changes.glsl"
#include "light_beam.glsl"
#include "chain_landing.glsl"

// The first receiver that the path's light lands on. Returns false where it lands on none. `finest`: spacing of the lattice after all
// refinements over that before.
bool land_on(ChainPath path, ChainHit hit, float finest, inout PilotRay ray) {
    for (uint index = 0; index < push.receiver_count; index++) {
        PlanarReceiver receiver = planar_receiver_at(index);
        float distance_;
        vec2 place;
        if (!lands_on(path, hit, receiver, distance_, place)) continue;
        ray.flux = dot(flux_after(path, distance_), vec3(1.0 / 3.0));
        ray.receiver = index;
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
        if (DISPERSES) ray.dispersed = dispersion_on(mesh_receivers[mesh], path, hit, finest);
        return true;
    }
    return false;
}

void main() {
    uint index = thread_index();
    if (index >= push.pilot_count) return;
    PilotRay ray = PilotRay(0.0, 0, 0, 0.0);
    ChainPath path = ray_of_lattice(index);
    float finest = 1.0;
    if (DISPERSES) finest = exp2(-float(lattice_of(index).refinements));
    for (;;) {
        ChainHit hit = hit_of(path);
        ray.interfaces = interfaces_of(path);
        if (!is_first(path) && land_on(path, hit, finest, ray)) break;
        Interaction at;
        if (ray.interfaces >= push.max_interfaces || !interact(path, hit, at)) break;
        Lobe lobe;
        bool refracts;
        if (!choose_lobe(path, at, choice(index, ray.interfaces), lobe, refracts)) break;
        if (DISPERSES) path = next_path(path, hit, at, transfer_to(path, hit, at), lobe, refracts);
        else path = next_ray(path, hit, at, lobe, refracts);
    }
    pilot_rays[index] = ray;
}
