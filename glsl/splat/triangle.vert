// triangle: expands each splat into the quad of the texels that it may touch.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"
#include "kernel.glsl"
#include "outer_corner.glsl"

TRIANGLE_SPLATS(0)
layout(location = 0) out flat vec4 blur;
layout(location = 1) out flat vec4 corners01;
layout(location = 2) out flat vec4 corner2_density12;
layout(location = 3) out flat vec4 irradiance_points;
layout(location = 4) out flat vec4 origin_slant;

void main() {
    TriangleSplat splat = triangle_splat_at(gl_VertexIndex / 4);
    blur = splat.blur;
    corners01 = splat.corners01;
    corner2_density12 = vec4(splat.corner2, splat.density12);
    irradiance_points = vec4(splat.irradiance, splat.points);
    origin_slant = vec4(splat.origin, splat.slant);
    vec2 at = quad_corner(splat.lower, splat.upper);
    if (splat.upper.x == AS_TRIANGLE) {
        // The second triangle of the quad is empty.
        at = splat.lower + outer_corner(splat, min(gl_VertexIndex % 4, 2));
    }
    gl_Position = clip_position(at);
}
