// direct points: direct light at points of meshes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
LIGHTS(3)
DIRECT_CELLS_OF(4)
layout(std430, binding = 5) readonly buffer SurfacePoints { SurfacePoint surface_points[]; };
layout(std430, binding = 7) readonly buffer TracedPoints { uint traced_points[]; };
layout(std430, binding = 6) writeonly buffer PointLight { vec4 point_light[]; };
layout(push_constant) uniform DirectPointsPush {
    uint first;          // first one of this range of `traced_points`
    uint end;            // of the range
    uint light_count;
    uint first_cell;     // environment cells that points have rays to: every cell_step-th before end_cell
    uint cell_step;
    uint end_cell;       // 0: no environment
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "surface.glsl"
#include "sampling.glsl"
#include "open_light.glsl"
#include "beam.glsl"
#include "lighting.glsl"
#include "direct_cells.glsl"

void main() {
    uint item = push.first + gl_GlobalInvocationID.x;
    if (item >= push.end) return;
    uint index = traced_points[item];
    SurfacePoint point = surface_points[index];
    uint self = point.triangle;
    Triangle triangle = triangle_at(self);
    Normals corner = normals_at(self);
    // Rays from a corner or an edge would meet the triangles beside it.
    vec2 w = mix(unpackUnorm2x16(point.weights), vec2(1.0 / 3.0), 0.02);
    vec3 x = triangle.position + w.x * triangle.edge1 + w.y * triangle.edge2;
    vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
    x = on_smooth_surface(triangle, corner, x, w);
    vec3 a, b;
    basis(n, a, b);
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < push.light_count; i++) {
        Light light = light_at(i);
        LightDisc disc = disc_at(light, x);
        if (is_below(disc, n)) continue;
        uint shade = trace_beam(beam_to(light, disc, x, n, point.radius * a, point.radius * b, CURVATURE), true);
        if (shade == IS_DARK) continue;
        if (shade == IS_LIT && !is_cut(disc, n)) {
            sum += light.power * open_irradiance(disc, n);
            continue;
        }
        for (uint k = 0; k < POINT_LIGHT_RAYS; k++) {
            sum += light.power * ray_irradiance(light, x, n, self, k, POINT_LIGHT_RAYS) / float(POINT_LIGHT_RAYS);
        }
    }
    sum += cells_irradiance(x, n, self, push.first_cell + index % push.cell_step, push.cell_step, push.end_cell);
    point_light[index] = vec4(sum, 0.0);
}
