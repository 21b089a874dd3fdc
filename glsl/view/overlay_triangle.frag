// overlay triangle: the triangle without its blur, or the line on which a kernel has half of its largest value.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(location = 0) in vec2 place;
layout(location = 1) in flat vec4 blur;
layout(location = 2) in flat vec4 corners01;
layout(location = 3) in flat vec4 corner2_slant;
layout(location = 4) in flat float points;
layout(location = 0) out vec4 result;

#include "overlay.glsl"
#include "kernel.glsl"
#include "outline.glsl"

void main() {
    vec2 at = place / max(1.0 + dot(corner2_slant.zw, place), 1e-3);
    vec2 centre = points == IS_BLURRED ? mat2(blur.xy, blur.zw) * at : at;
    vec2 a = corners01.xy - centre;
    vec2 b = corners01.zw - centre;
    vec2 c = corner2_slant.xy - centre;
    vec3 areas = vec3(cross2(b, c), cross2(c, a), cross2(a, b));
    float of_triangle = outline_of(areas / max(areas.x + areas.y + areas.z, 1e-9));
    float of_kernel = contour_of(kernel_value(blur.w, quadratic2(blur.xyz, at)));
    bool is_kernel = points == IS_KERNEL;
    vec3 color = is_kernel ? vec3(1.0, 0.35, 0.8) : vec3(1.0, 0.75, 0.1);
    result = vec4(push.white * color, is_kernel ? of_kernel : of_triangle);
}
