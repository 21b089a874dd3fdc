// triangle: the triangle's irradiance, blurred by the box that stands for a texel and the light's disc. The triangle
// covers a share of the box around the texel's centre. Sampling at texel centres would miss triangles between the
// centres, or count their flux several times.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "constants.glsl"
#include "kernel.glsl"
#include "blurred_triangle.glsl"

layout(location = 0) in flat vec4 to_box;
layout(location = 1) in flat vec4 corners01;
layout(location = 2) in flat vec4 corner2_density12;
layout(location = 3) in flat vec4 irradiance_density0;
layout(location = 4) in flat vec4 origin_slant;
layout(location = 0) out vec4 result;

// Share of the parallelogram around the texel's centre that the triangle covers, times the triangle's density there.
float triangle_value(vec2 at) {
    vec2 centre = mat2(to_box.xy, to_box.zw) * at;
    vec2 a = corners01.xy - centre;
    vec2 b = corners01.zw - centre;
    vec2 c = corner2_density12.xy - centre;
    float share = share_in_square(a, b, c);
    // Barycentric coordinates of the centre, clamped to the triangle.
    vec3 weights = max(vec3(cross2(b, c), cross2(c, a), cross2(a, b)), 0.0);
    float density = dot(weights, vec3(irradiance_density0.w, corner2_density12.zw)) / (weights.x + weights.y + weights.z);
    return share * density;
}

void main() {
    vec2 at = gl_FragCoord.xy - origin_slant.xy;
    // The place without perspective, and the change of areas that perspective makes.
    float scale = 1.0 / max(1.0 + dot(origin_slant.zw, at), 1e-3);
    at *= scale;
    float value = irradiance_density0.w == IS_KERNEL ? kernel_value(to_box.w, quadratic2(to_box.xyz, at)) : triangle_value(at);
    result = vec4(irradiance_density0.xyz * (value * scale * scale * scale), 0.0);
}
