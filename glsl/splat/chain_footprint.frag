// chain footprint: evaluates the kernel at the texel's centre, and the texel's share of the parallelogram.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernel.glsl"
#include "blurred_triangle.glsl"

layout(location = 0) in flat vec4 conic_and_flatness;
layout(location = 1) in flat vec4 irradiance_and_kernel;
layout(location = 2) in flat vec4 sides;
layout(location = 3) in flat vec3 centre_and_share;
layout(location = 0) out vec4 irradiance;

void main() {
    vec2 d = gl_FragCoord.xy - centre_and_share.xy;
    float value = irradiance_and_kernel.w * kernel_value(conic_and_flatness.w, quadratic2(conic_and_flatness.xyz, d));
    value += centre_and_share.z * parallelogram_value(sides.xy, sides.zw, d, centre_and_share.z > 0.0);
    irradiance = vec4(irradiance_and_kernel.rgb * value, 0.0);
}
