// chain footprint: expands the footprints of landings of chains into screen-aligned quads. Vertex 4 i + c is corner c of footprint i.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"

layout(std430, binding = 0) readonly buffer Footprints { ChainFootprint footprints[]; };
layout(location = 0) out flat vec4 conic_and_flatness;
layout(location = 1) out flat vec4 irradiance_and_kernel;
layout(location = 2) out flat vec4 sides;
layout(location = 3) out flat vec4 centre_slant;
layout(location = 4) out flat float share;

void main() {
    ChainFootprint footprint = footprints[gl_VertexIndex / 4];
    conic_and_flatness = vec4(footprint.conic, footprint.flatness);
    irradiance_and_kernel = vec4(footprint.irradiance, footprint.kernel);
    sides = footprint.sides;
    centre_slant = vec4(footprint.centre, unpackHalf2x16(footprint.slant));
    share = footprint.share;
    gl_Position = clip_position(quad_corner(footprint.lower, footprint.upper));
}
