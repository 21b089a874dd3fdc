// environment points: direct light of the environment at points of meshes.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
DIRECT_CELLS_OF(3)
layout(std430, binding = 4) readonly buffer SurfacePoints { SurfacePoint surface_points[]; };
layout(std430, binding = 5) readonly buffer TracedPoints { uint traced_points[]; };
layout(std430, binding = 6) writeonly buffer PointEnvironment { vec4 point_environment[]; };
layout(push_constant) uniform EnvironmentPointsPush {
    uint first;          // first one of this range of `traced_points`
    uint end;            // of the range
    uint first_cell;     // points have rays to every cell_step-th cell before end_cell
    uint cell_step;
    uint end_cell;
} push;

#include "trace.glsl"
#include "surface.glsl"
#include "surface_points.glsl"
#include "direct_cells.glsl"

void main() {
    uint item = push.first + gl_GlobalInvocationID.x;
    if (item >= push.end) return;
    uint index = traced_points[item];
    SurfacePoint point = surface_points[index];
    vec3 x, n;
    locate(point, x, n);
    // Neighbours have rays to other cells.
    uint first_cell = push.first_cell + index % push.cell_step;
    point_environment[index] = vec4(cells_irradiance(x, n, point.triangle, first_cell, push.cell_step, push.end_cell), 0.0);
}
