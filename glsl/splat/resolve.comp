// resolve: adds each coarser level of the light maps to the next finer one, interpolated. Repeated bilinear steps
// approximate a quadratic B-spline.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
PLANAR_RECEIVERS(0)
layout(std430, binding = 1) readonly buffer Coarse { uint coarse[]; }; // per receiver: bit l is set where footprints are in level l
layout(binding = 2, rgba32f) uniform image2D light_map;
layout(push_constant) uniform ResolvePush {
    int level;           // level that is added to
    int first_row;       // first coarser row of this step, counted with the border
} push;

#include "planar_receiver.glsl"

// The two texels of the finer level in a texel of the coarser row, interpolated along the row: weight 3/4 for the coarser texel that
// contains them, and 1/4 for the nearer neighbour.
struct Pair {
    vec4 texel[2];
};

Pair pair_of(ivec2 place) {
    vec4 near = 0.75 * imageLoad(light_map, place);
    return Pair(vec4[2](near + 0.25 * imageLoad(light_map, place - ivec2(1, 0)), near + 0.25 * imageLoad(light_map, place + ivec2(1, 0))));
}

// Each thread adds RESOLVE_ROWS texels of a coarser column, so that each row is read once for the four rows that it is added to.
void main() {
    uint index = gl_GlobalInvocationID.z;
    if (coarse[index] >> (push.level + 1) == 0) return;
    Level fine = level_of(planar_receiver_at(index), push.level);
    Level wide = level_of(planar_receiver_at(index), push.level + 1);
    int around = push.level > 0 ? 1 : 0;
    ivec2 end = fine.size + around;
    ivec2 texel = ivec2(gl_GlobalInvocationID.x, int(gl_GlobalInvocationID.y) * RESOLVE_ROWS + push.first_row) - around;
    if (any(greaterThanEqual(2 * texel, end))) return;
    Pair below = pair_of(wide.origin + texel - ivec2(0, 1));
    Pair here = pair_of(wide.origin + texel);
    for (int row = 0; row < RESOLVE_ROWS; row++, texel.y++) {
        Pair above = pair_of(wide.origin + texel + ivec2(0, 1));
        for (int i = 0; i < 4; i++) {
            ivec2 of_fine = 2 * texel + ivec2(i & 1, i >> 1);
            vec4 light = 0.75 * here.texel[i & 1] + 0.25 * (i < 2 ? below : above).texel[i & 1];
            // Most texels of a light map get nothing from coarser levels.
            if (light == vec4(0.0) || any(lessThan(of_fine, ivec2(-around))) || any(greaterThanEqual(of_fine, end))) continue;
            ivec2 place = fine.origin + of_fine;
            imageStore(light_map, place, imageLoad(light_map, place) + light);
        }
        below = here;
        here = above;
    }
}
