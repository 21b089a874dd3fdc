// triangle: the triangle's irradiance, blurred by a texel and the light's disc. The triangle covers a share of the parallelogram around the
// texel's centre that stands for both, or of the texel, seen from each of the points that stand for the disc. Sampling at texel centres
// would miss triangles between the centres, or count their flux several times.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "constants.glsl"
#include "kernel.glsl"
#include "blurred_triangle.glsl"

layout(location = 0) in flat vec4 blur;
layout(location = 1) in flat vec4 corners01;
layout(location = 2) in flat vec4 corner2_density12;
layout(location = 3) in flat vec4 irradiance_points;
layout(location = 4) in flat vec4 origin_slant;
layout(location = 0) out vec4 result;

// Mean share of the squares that the triangle covers, times the triangle's density at the texel's centre.
float triangle_value(vec2 at, float points) {
    mat2 m = mat2(blur.xy, blur.zw);
    vec2 centre = points == IS_BLURRED ? m * at : at;
    vec2 a = corners01.xy - centre;
    vec2 b = corners01.zw - centre;
    vec2 c = corner2_density12.xy - centre;
    Side sides[3] = Side[](side_between(a, b), side_between(b, c), side_between(c, a));
    // The points are at -1 and +1 times `to_point` along both columns. Without points, there is one square around the centre.
    float shares = 0.0;
    float squares = max(points, 1.0);
    float to_point = points > 1.0 ? POINT_DISTANCE : 0.0;
    for (float i = 0.0; i < squares; i++) {
        to_point = -to_point;
        // lavapipe is slow with an index that varies.
        shares += share_in_square(sides, to_point * (i < 2.0 ? m[0] : m[1]));
    }
    // Barycentric coordinates of the centre, clamped to the triangle. The mean density over the corners is 1.
    vec3 weights = max(vec3(cross2(b, c), cross2(c, a), cross2(a, b)), 0.0);
    vec3 density = vec3(3.0 - corner2_density12.z - corner2_density12.w, corner2_density12.zw);
    return shares / squares * dot(weights, density) / (weights.x + weights.y + weights.z);
}

void main() {
    vec2 at = gl_FragCoord.xy - origin_slant.xy;
    // The place without perspective, and the change of areas that perspective makes.
    float scale = 1.0 / max(1.0 + dot(origin_slant.zw, at), 1e-3);
    at *= scale;
    float points = irradiance_points.w;
    float value = points == IS_KERNEL ? kernel_value(blur.w, quadratic2(blur.xyz, at)) : triangle_value(at, points);
    result = vec4(irradiance_points.xyz * (value * scale * scale * scale), 0.0);
}
