// footprint: evaluates the kernel at the texel's centre. The kernel spreads the flux over directions; s is the distance
// to the texel over the distance to the footprint's centre.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernel.glsl"

layout(location = 0) in flat vec4 conic_and_flatness;
layout(location = 1) in flat vec4 centre_and_clip;
layout(location = 2) in flat vec4 peak_and_clip;
layout(location = 3) in flat vec4 slant_and_bulge;
layout(location = 0) out vec4 irradiance;

void main() {
    vec2 d = gl_FragCoord.xy - centre_and_clip.xy;
    float aside = dot(slant_and_bulge.xy, d);
    float s2 = 1.0 + 2.0 * aside + dot(slant_and_bulge.zw, d * d);
    float value = kernel_value(conic_and_flatness.w, quadratic2(conic_and_flatness.xyz, d) / s2);
    value *= max(1.0 + aside, 0.0) / (s2 * s2);
    float share = clamp(peak_and_clip.w + dot(centre_and_clip.zw, d), 0.0, 1.0);
    irradiance = vec4(peak_and_clip.rgb * (value * share), 0.0);
}
