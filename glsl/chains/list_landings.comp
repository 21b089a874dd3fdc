// list landings: copies the paths of a wave that reach mesh receivers to the list of landings, in their order.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
OBJECTS(1)
CHAIN_PATHS(2)
CHAIN_HITS(3)
layout(std430, binding = 4) readonly buffer Waves { uint waves[]; };
layout(std430, binding = 5) readonly buffer LandingNumbers { uvec2 landing_numbers[]; }; // prefix sums
layout(std430, binding = 6) readonly buffer LandingSums { uvec2 landing_sums[]; };
layout(std430, binding = 7) writeonly buffer LandingPaths { ChainPath landing_paths[]; };
layout(std430, binding = 8) writeonly buffer LandingHits { ChainHit landing_hits[]; };
layout(std430, binding = 9) readonly buffer Spectrum { vec4 weights_below[]; };
layout(std430, binding = 10) buffer FluxSums { uint flux_sums[]; };
NORMALS(11)
LIGHTS(12)
#include "chain_push.glsl"

#include "blocks.glsl"
#include "optics.glsl"
#include "media.glsl"
#include "planar_receiver.glsl"
#include "kernel.glsl"
#include "chain_ray.glsl"
#include "chain.glsl"
#include "spectrum.glsl"
#include "chain_flux.glsl"

void main() {
    uint index = thread_index();
    if (index >= waves[UNITS_WORD]) return;
    ChainHit hit = hit_at(index);
    if ((hit.footprints & ON_MESHES) == 0) return;
    uint place = waves[LANDINGS_WORD] + landing_numbers[index].x + landing_sums[index / SPLAT_GROUP].x;
    ChainPath path = path_at(index);
    if (place < push.path_capacity) {
        landing_paths[place] = path;
        landing_hits[place] = hit;
    } else if (COUNTS_FLUX) {
        count_no_room_on_meshes(path, hit);
    }
}
