// Sums over a rectangle of two images of light, one of each side, for every square of texels.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "constants.glsl"
#include "difference.glsl"

// Invocations of a workgroup along a side.
const uint GROUP_SIDE = 16;

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;

layout(set = 0, binding = 0) uniform sampler2D image_a;
layout(set = 0, binding = 1) uniform sampler2D image_b;
// Sum of |a - b| and of b over the channels, of the squared difference, and of a over the channels.
layout(set = 0, binding = 2) writeonly buffer Sums { vec4 sums[]; };

layout(push_constant) uniform Push {
    uvec2 origin_a;
    uvec2 origin_b;
    // Texels.
    uvec2 size;
    // Where the sums go.
    uint first;
    uint is_relative;
};

shared vec4 shares[GROUP_SIDE * GROUP_SIDE];

void main() {
    vec4 sum = vec4(0.0);
    uvec2 block = BLOCK_SIDE * gl_WorkGroupID.xy;
    for (uint y = gl_LocalInvocationID.y; y < BLOCK_SIDE; y += GROUP_SIDE) {
        for (uint x = gl_LocalInvocationID.x; x < BLOCK_SIDE; x += GROUP_SIDE) {
            uvec2 texel = block + uvec2(x, y);
            if (any(greaterThanEqual(texel, size))) continue;
            vec3 a = texelFetch(image_a, ivec2(origin_a + texel), 0).rgb;
            vec3 b = texelFetch(image_b, ivec2(origin_b + texel), 0).rgb;
            float d = difference(a, b, is_relative != 0);
            sum += vec4(dot(abs(a - b), vec3(1.0)), dot(b, vec3(1.0)), d * d, dot(a, vec3(1.0)));
        }
    }
    shares[gl_LocalInvocationIndex] = sum;
    for (uint half_count = GROUP_SIDE * GROUP_SIDE / 2; half_count > 0; half_count /= 2) {
        barrier();
        if (gl_LocalInvocationIndex < half_count) {
            shares[gl_LocalInvocationIndex] += shares[gl_LocalInvocationIndex + half_count];
        }
    }
    if (gl_LocalInvocationIndex == 0) sums[first + gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x] = shares[0];
}
