// direct points: direct light of suns and lamps at points of meshes without light maps, added to that of the environment.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
LIGHTS(3)
layout(std430, binding = 4) readonly buffer SurfacePoints { SurfacePoint surface_points[]; };
layout(std430, binding = 5) readonly buffer TracedPoints { uint traced_points[]; };
layout(std430, binding = 6) writeonly buffer PointLight { vec4 point_light[]; };
layout(std430, binding = 7) readonly buffer PointEnvironment { vec4 point_environment[]; };
layout(constant_id = ID_HAS_ENVIRONMENT) const bool HAS_ENVIRONMENT = true;
layout(push_constant) uniform DirectPointsPush {
    uint first;          // first one of this range of `traced_points`
    uint end;            // of the range
    uint light_count;
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "surface.glsl"
#include "sampling.glsl"
#include "open_light.glsl"
#include "beam.glsl"
#include "lighting.glsl"
#include "surface_points.glsl"

void main() {
    uint item = push.first + gl_GlobalInvocationID.x;
    if (item >= push.end) return;
    uint index = traced_points[item];
    SurfacePoint point = surface_points[index];
    uint self = point.triangle;
    vec3 x, n, a, b;
    locate(point, x, n);
    basis(n, a, b);
    vec3 sum = HAS_ENVIRONMENT ? point_environment[index].rgb : vec3(0.0);
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
    point_light[index] = vec4(sum, 0.0);
}
