// splat: expands footprints into screen-aligned quads. Vertex 4 f + c is corner c of footprint f.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(std430, binding = 0) readonly buffer Footprints { Footprint footprints[]; };
layout(push_constant) uniform DrawPush {
    vec2 atlas_size;  // texels
} push;
layout(location = 0) out flat vec4 conic_and_flatness;
layout(location = 1) out flat vec4 centre_and_clip;
layout(location = 2) out flat vec4 peak_and_clip;
layout(location = 3) out flat vec4 slant_and_bulge;

void main() {
    Footprint footprint = footprints[gl_VertexIndex / 4];
    vec2 corner = mix(footprint.lower, footprint.upper, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1));
    conic_and_flatness = vec4(footprint.conic, footprint.flatness);
    centre_and_clip = vec4(footprint.centre, footprint.clip.xy);
    peak_and_clip = vec4(footprint.peak, footprint.clip.z);
    slant_and_bulge = vec4(footprint.slant, footprint.bulge_x, footprint.bulge_y);
    gl_Position = vec4(corner / push.atlas_size * 2.0 - 1.0, 0.0, 1.0);
}
