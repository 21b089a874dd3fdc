// overlay triangle: the splats of suns and lamps on planar receivers, with what outlines them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLE_SPLATS(0)
PLANAR_RECEIVERS(1)
layout(location = 0) out vec2 place;        // from the splat's origin, texels
layout(location = 1) out flat vec4 blur;
layout(location = 2) out flat vec4 corners01;
layout(location = 3) out flat vec4 corner2_slant;
layout(location = 4) out flat float points;

#include "overlay.glsl"
#include "kernel.glsl"
#include "outer_corner.glsl"
#include "planar_receiver.glsl"
#include "light_map_place.glsl"

void main() {
    TriangleSplat splat = triangle_splat_at(gl_VertexIndex / 4);
    blur = splat.blur;
    corners01 = splat.corners01;
    corner2_slant = vec4(splat.corner2, splat.slant);
    points = splat.points;
    // As triangle.vert draws it.
    vec2 at = mix(splat.lower, splat.upper, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1));
    if (splat.upper.x == AS_TRIANGLE) {
        at = splat.lower + outer_corner(splat, min(gl_VertexIndex % 4, 2));
    }
    place = at - splat.origin;
    gl_Position = splat.lower == splat.upper ? NOWHERE : seen_on_receiver(at, splat.lower + 0.5);
}
