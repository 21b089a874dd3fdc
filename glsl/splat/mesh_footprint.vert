// mesh_footprint: expands mesh footprints into screen-aligned quads. Vertex 4 i + c is corner c of footprint i.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"

layout(std430, binding = 0) readonly buffer MeshFootprints { MeshFootprint mesh_footprints[]; };
layout(location = 0) out flat vec4 centre_and_flatness;
layout(location = 1) out flat vec4 u_and_travelled;
layout(location = 2) out flat vec3 v;
layout(location = 3) out flat vec4 direction_and_growth;
layout(location = 4) out flat vec4 conic_and_tolerance;
layout(location = 5) out flat vec3 peak;
layout(location = 6) out flat vec3 occluder;
layout(location = 7) out flat vec3 occluder_normal;
layout(location = 8) out flat ivec2 base_and_stride;

void main() {
    MeshFootprint footprint = mesh_footprints[gl_VertexIndex / 4];
    vec2 low = vec2(footprint.low & 0xffffu, footprint.low >> 16);
    vec2 high = vec2(footprint.high & 0xffffu, footprint.high >> 16);
    centre_and_flatness = vec4(footprint.centre, footprint.flatness);
    u_and_travelled = vec4(footprint.u, footprint.travelled);
    v = footprint.v;
    direction_and_growth = vec4(footprint.direction, footprint.growth);
    conic_and_tolerance = vec4(footprint.conic, footprint.tolerance);
    peak = footprint.peak;
    occluder = footprint.occluder;
    occluder_normal = footprint.occluder_normal;
    base_and_stride = ivec2(footprint.base, footprint.stride);
    gl_Position = clip_position(quad_corner(low, high));
}
