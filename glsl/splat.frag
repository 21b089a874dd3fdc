// splat: the kernel's value at the texel's centre.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernel.glsl"

layout(location = 0) in flat vec4 conic_and_flatness;
layout(location = 1) in flat vec3 peak;
layout(location = 2) in flat vec3 cut;
layout(location = 3) in flat vec2 centre;
layout(location = 0) out vec4 irradiance;

void main() {
    vec2 d = gl_FragCoord.xy - centre;
    float value = kernel_value(conic_and_flatness.w, quadratic2(conic_and_flatness.xyz, d));
    float share = clamp(cut.z + dot(cut.xy, d), 0.0, 1.0);
    irradiance = vec4(peak * (value * share), 0.0);
}
