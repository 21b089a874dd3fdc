// overlay footprint: the kernels of environment cells on planar receivers.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(std430, binding = 0) readonly buffer Footprints { Footprint footprints[]; };
PLANAR_RECEIVERS(1)
layout(location = 0) out vec2 place;        // from the centre, texels
layout(location = 1) out flat vec4 conic_and_flatness;
layout(location = 2) out flat vec2 slant;
layout(location = 3) out flat vec3 bulge;   // matrix xx, xy, yy

#include "overlay.glsl"
#include "planar_receiver.glsl"
#include "light_map_place.glsl"

void main() {
    Footprint footprint = footprints[gl_VertexIndex / 4];
    conic_and_flatness = vec4(footprint.conic, footprint.flatness);
    slant = footprint.slant;
    bulge = vec3(footprint.bulge_x, 0.0, footprint.bulge_y);
    vec2 at = mix(footprint.lower, footprint.upper, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1));
    place = at - footprint.centre;
    gl_Position = gl_VertexIndex / 4 % push.every == 0 ? seen_on_receiver(at, footprint.lower + 0.5) : NOWHERE;
}
