// splat: the kernel's value at the texel's centre.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernel.glsl"

layout(location = 0) in flat vec4 centre_and_fold;
layout(location = 1) in flat vec4 conic_and_shape;
layout(location = 2) in flat vec3 peak;
layout(location = 0) out vec4 irradiance;

void main() {
    vec2 d = gl_FragCoord.xy - centre_and_fold.xy;
    irradiance = vec4(peak * footprint_value(conic_and_shape.w, conic_and_shape.xyz, centre_and_fold.zw, d), 0.0);
}
