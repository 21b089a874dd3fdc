// chain footprint: evaluates the kernel at the texel's centre, and the texel's share of the parallelogram.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "kernel.glsl"
#include "blurred_triangle.glsl"

layout(location = 0) in flat vec4 conic_and_flatness;
layout(location = 1) in flat vec4 irradiance_and_kernel;
layout(location = 2) in flat vec4 sides;
layout(location = 3) in flat vec4 centre_slant;
layout(location = 4) in flat float share;
layout(location = 5) in flat vec4 bounds;
layout(location = 0) out vec4 irradiance;

// At places with smaller ratios to those without perspective there is no light: it goes to one side of the line where the ratio is 0.
const float LEAST_RATIO = 0.02;

void main() {
    vec2 d = gl_FragCoord.xy - centre_slant.xy;
    float value = share * parallelogram_value(sides.xy, sides.zw, d, share > 0.0);
    // The place without perspective, and the change of areas that perspective makes.
    float ratio = 1.0 + dot(centre_slant.zw, d);
    float scale = ratio > LEAST_RATIO ? 1.0 / ratio : 0.0;
    float kernel = kernel_value(conic_and_flatness.w, quadratic2(conic_and_flatness.xyz, scale * d));
    value += irradiance_and_kernel.w * scale * scale * scale * kernel;
    // A turned quad may reach beyond the receiver's tile.
    bool is_inside = all(greaterThan(gl_FragCoord.xy, bounds.xy)) && all(lessThan(gl_FragCoord.xy, bounds.zw));
    irradiance = vec4(irradiance_and_kernel.rgb * (is_inside ? value : 0.0), 0.0);
}
