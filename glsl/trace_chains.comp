// trace chains: finds what the rays of a wave of chains meet, and counts the lobes to follow and the footprints of each.
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
layout(std430, binding = 7) readonly buffer Paths { ChainPath paths[]; };
layout(std430, binding = 8) writeonly buffer Hits { ChainHit hits[]; };
layout(std430, binding = 9) writeonly buffer Numbers { uvec2 numbers[]; }; // lobes, footprints
layout(std430, binding = 10) buffer Waves { uint waves[]; };
#include "chain_push.glsl"

#include "blocks.glsl"
#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "media.glsl"
#include "planar_receiver.glsl"
#include "chain.glsl"

// Ends of displaced bodies on a ray, at most.
const uint MAX_PASSED = 16;

// The nearest interface, mirror or diffuse surface. Where one body ends within another that displaces it, the ray goes on as if
// nothing were there.
ChainHit hit_of(ChainPath path) {
    float travelled = 0.0;
    vec3 origin = path.position;
    uint self = path.triangle;
    uvec2 media = path.media;
    for (uint i = 0; i < MAX_PASSED; i++) {
        Hit hit = nearest(origin, path.direction, self, OCCLUDES | IS_MESH_RECEIVER);
        ChainHit found = ChainHit(travelled + hit.distance, hit.triangle, hit.barycentric, media, uvec2(0));
        if (hit.triangle == NO_TRIANGLE) return found;
        Triangle triangle = triangle_at(hit.triangle);
        Object object = object_at(triangle.object);
        if (!is_body(object)) return found;
        uvec2 before, behind;
        bool front = dot(cross(triangle.edge1, triangle.edge2), path.direction) < 0.0;
        media_at(media, object, front, before, behind);
        if (filling(before).number != filling(behind).number) return found;
        travelled += hit.distance;
        origin += hit.distance * path.direction;
        self = hit.triangle;
        media = behind;
    }
    return ChainHit(FAR, NO_TRIANGLE, vec2(0.0), media, uvec2(0));
}

void main() {
    uint index = thread_index();
    bool is_first = push.is_first != 0;
    if (is_first && index == 0) waves[6] = push.ray_count;
    if (index >= (is_first ? push.ray_count : waves[6])) return;
    ChainLattice lattice;
    ChainPath path;
    if (is_first) {
        lattice = lattice_of(index);
        path = ray_of_lattice(lattice, index);
    } else {
        path = paths[index];
    }
    ChainHit hit = hit_of(path);
    hits[index] = hit;

    uvec2 number = uvec2(0);
    Interaction at;
    if (interfaces_of(path) < push.max_interfaces && interact(path, hit, lattice, is_first, at)) {
        Lobe lobes[2];
        lobes_of(path, at, lobes);
        number.x = uint(lobes[0].is_followed) + uint(lobes[1].is_followed);
    }
    // Light of a single surface is that of the facets.
    if (interfaces_of(path) > 1) {
        for (uint receiver = 0; receiver < push.receiver_count; receiver++) {
            Landing landing;
            if (land(path, hit, planar_receiver_at(receiver), receiver, landing)) number.y++;
        }
    }
    numbers[index] = number;
}
