// triangle: the triangle's irradiance, blurred by the box that stands for a texel and the light's disc. The triangle
// covers a share of the box around the texel's centre. Sampling at texel centres would miss triangles between the
// centres, or count their flux several times.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "constants.glsl"
#include "kernel.glsl"

layout(location = 0) in flat vec4 to_box;
layout(location = 1) in flat vec4 corners01;
layout(location = 2) in flat vec4 corner2_density12;
layout(location = 3) in flat vec4 irradiance_density0;
layout(location = 4) in flat vec4 origin_slant;
layout(location = 0) out vec4 result;

// The integral over y from 0 to 1 of x, clamped to 0 to 1, along the side from a to b; negative where the side runs
// toward -y. The sum over three sides is the area within the unit square (Green's theorem).
float side_integral(vec2 a, vec2 b) {
    // Always in the same direction, so that two triangles with a common side compute the same value.
    bool forward = a.y < b.y;
    vec2 low = forward ? a : b;
    vec2 high = forward ? b : a;
    float y0 = clamp(low.y, 0.0, 1.0);
    float y1 = clamp(high.y, 0.0, 1.0);
    if (y0 >= y1) return 0.0;
    float slope = (high.x - low.x) / (high.y - low.y);
    float first = low.x + (y0 - low.y) * slope;
    float last = low.x + (y1 - low.y) * slope;
    float x0 = min(first, last);
    float x1 = max(first, last);
    float c0 = clamp(x0, 0.0, 1.0);
    float c1 = clamp(x1, 0.0, 1.0);
    // Mean of the clamped x between x0 and x1: the part within 0 to 1, and the part above 1.
    float mean = c0;
    if (x1 - x0 > 1e-6) mean = (0.5 * (c1 - c0) * (c1 + c0) + max(x1 - max(x0, 1.0), 0.0)) / (x1 - x0);
    return (forward ? y1 - y0 : y0 - y1) * mean;
}

// Share of the parallelogram around the texel's centre that the triangle covers, times the triangle's density there.
float triangle_value(vec2 at) {
    vec2 centre = mat2(to_box.xy, to_box.zw) * at;
    vec2 a = corners01.xy - centre;
    vec2 b = corners01.zw - centre;
    vec2 c = corner2_density12.xy - centre;
    // The unit square around the centre.
    float share = side_integral(a + 0.5, b + 0.5) + side_integral(b + 0.5, c + 0.5) + side_integral(c + 0.5, a + 0.5);
    // Barycentric coordinates of the centre, clamped to the triangle.
    vec3 weights = max(vec3(cross2(b, c), cross2(c, a), cross2(a, b)), 0.0);
    float density = dot(weights, vec3(irradiance_density0.w, corner2_density12.zw)) / (weights.x + weights.y + weights.z);
    return clamp(share, 0.0, 1.0) * density;
}

void main() {
    vec2 at = gl_FragCoord.xy - origin_slant.xy;
    // The place without perspective, and the change of areas that perspective makes.
    float scale = 1.0 / max(1.0 + dot(origin_slant.zw, at), 1e-3);
    at *= scale;
    float value = irradiance_density0.w == IS_KERNEL ? kernel_value(to_box.w, quadratic2(to_box.xyz, at)) : triangle_value(at);
    result = vec4(irradiance_density0.xyz * (value * scale * scale * scale), 0.0);
}
