// overlay footprint: the ellipse on which the kernel has half of its largest value.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(location = 0) in vec2 place;
layout(location = 1) in flat vec4 conic_and_flatness;
layout(location = 2) in flat vec2 slant;
layout(location = 3) in flat vec3 bulge;
layout(location = 0) out vec4 result;

#include "overlay.glsl"
#include "kernel.glsl"
#include "outline.glsl"

void main() {
    // As footprint.frag and chain_footprint.frag evaluate it.
    float s2 = 1.0 + 2.0 * dot(slant, place) + quadratic2(bulge, place);
    float value = kernel_value(conic_and_flatness.w, quadratic2(conic_and_flatness.xyz, place) / s2);
    result = vec4(push.white * vec3(1.0, 0.35, 0.8), contour_of(value));
}
