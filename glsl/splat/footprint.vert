// footprint: expands footprints into screen-aligned quads. Vertex 4 i + c is corner c of footprint i.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"

layout(std430, binding = 0) readonly buffer Footprints { Footprint footprints[]; };
layout(location = 0) out flat vec4 conic_and_flatness;
layout(location = 1) out flat vec4 centre_and_clip;
layout(location = 2) out flat vec4 peak_and_clip;
layout(location = 3) out flat vec4 slant_and_bulge;

void main() {
    Footprint footprint = footprints[gl_VertexIndex / 4];
    conic_and_flatness = vec4(footprint.conic, footprint.flatness);
    centre_and_clip = vec4(footprint.centre, footprint.clip.xy);
    peak_and_clip = vec4(footprint.peak, footprint.clip.z);
    slant_and_bulge = vec4(footprint.slant, footprint.bulge_x, footprint.bulge_y);
    gl_Position = clip_position(quad_corner(footprint.lower, footprint.upper));
}
