// splat: the kernel's value at the texel's centre.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernel.glsl"

layout(location = 0) in flat vec4 centre_and_shape;
layout(location = 1) in flat vec3 conic;
layout(location = 2) in flat vec3 peak;
layout(location = 0) out vec4 irradiance;

void main() {
    float t = quadratic2(conic, gl_FragCoord.xy - centre_and_shape.xy);
    irradiance = vec4(peak * kernel_value(centre_and_shape.z, centre_and_shape.w, t), 0.0);
}
