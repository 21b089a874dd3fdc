// curved: the kernel's value at the centroid of what lies in the texel, times the cosine.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout.glsl"
#include "kernel.glsl"

layout(std430, binding = 1) readonly buffer AtlasTexels { AtlasTexel atlas_texels[]; };
layout(location = 0) in flat vec4 centre_and_flatness;
layout(location = 1) in flat vec4 u_and_before;
layout(location = 2) in flat vec3 v;
layout(location = 3) in flat vec3 along;
layout(location = 4) in flat vec4 conic_and_tolerance;
layout(location = 5) in flat vec3 peak;
layout(location = 6) in flat vec3 hit;
layout(location = 7) in flat vec3 front;
layout(location = 8) in flat ivec2 base_and_stride;
layout(location = 0) out vec4 irradiance;

// What lies behind the surface that the ray meets is in its shadow, by this much of the way between
// them at least.
const float BEHIND = 0.05;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    AtlasTexel texel = atlas_texels[base_and_stride.x + place.x + place.y * base_and_stride.y];
    vec3 q = texel.position - centre_and_flatness.xyz;
    vec2 d = vec2(dot(u_and_before.xyz, q), dot(v, q));
    float value = kernel_value(centre_and_flatness.w, quadratic2(conic_and_tolerance.xyz, d));
    float facing = max(-dot(along, texel.normal), 0.0);
    bool ahead = dot(along, q) > -u_and_before.w;
    // Blocked where the texel is behind the surface that the ray meets and that is before the texel's:
    // neither on one curved surface nor on two sides of an edge that light falls on.
    vec3 way = texel.position - hit;
    float least = conic_and_tolerance.w + BEHIND * length(way);
    bool blocked = dot(way, front) < -least && dot(way, texel.normal) < -least;
    irradiance = vec4(ahead && !blocked ? peak * (value * facing) : vec3(0.0), 0.0);
}
