// mesh_footprint: evaluates the kernel at the centroid of the surface in the texel, times the cosine.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "kernel.glsl"

layout(std430, binding = 1) readonly buffer AtlasTexels { AtlasTexel atlas_texels[]; };
layout(location = 0) in flat vec4 centre_and_flatness;
layout(location = 1) in flat vec4 u_and_travelled;
layout(location = 2) in flat vec3 v;
layout(location = 3) in flat vec4 direction_and_growth;
layout(location = 4) in flat vec4 conic_and_tolerance;
layout(location = 5) in flat vec3 peak;
layout(location = 6) in flat vec3 occluder;
layout(location = 7) in flat vec3 occluder_normal;
layout(location = 8) in flat ivec2 base_and_stride;
layout(location = 0) out vec4 irradiance;

// A texel is in shadow if it lies behind the occluder by at least this share of the distance between the two.
const float MIN_SHADOW_SLOPE = 0.05;
// Lower bound on the beam's width over its width at the footprint's centre. The footprint is not followed into a focus.
const float MIN_SIZE = 0.25;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    AtlasTexel texel = atlas_texels[base_and_stride.x + place.x + place.y * base_and_stride.y];
    vec3 q = texel.position - centre_and_flatness.xyz;
    vec3 direction = direction_and_growth.xyz;
    float forward = dot(direction, q);
    // The beam's width here over its width at the centre.
    float size = max(1.0 + direction_and_growth.w * forward, MIN_SIZE);
    vec2 d = vec2(dot(u_and_travelled.xyz, q), dot(v, q)) / size;
    float value = kernel_value(centre_and_flatness.w, quadratic2(conic_and_tolerance.xyz, d)) / (size * size);
    vec3 local_direction = direction + direction_and_growth.w / size * (q - forward * direction);
    float facing = max(-dot(local_direction, texel.normal), 0.0);
    bool ahead = forward > -u_and_travelled.w;
    // A texel is occluded where it lies behind the occluder's tangent plane and the occluder lies behind the texel's.
    // The test spares neighbouring points of one curved surface and two lit sides of an edge.
    vec3 off = texel.position - occluder;
    float least = conic_and_tolerance.w + MIN_SHADOW_SLOPE * length(off);
    bool occluded = dot(off, occluder_normal) < -least && dot(off, texel.normal) < -least;
    irradiance = vec4(ahead && !occluded ? peak * (value * facing) : vec3(0.0), 0.0);
}
