// direct atlas: direct light of the texels of a mesh's light map.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
LIGHTS(3)
SURFACES(4)
layout(std430, binding = 5) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 6) readonly buffer AtlasSamples_ { AtlasSamples atlas_samples[]; };
layout(std430, binding = 7) readonly buffer TrianglePointsBuffer { TrianglePoints triangle_points[]; };
layout(std430, binding = 9) readonly buffer PointLight { vec4 point_light[]; }; // of the environment
layout(binding = 8, rgba32f) uniform writeonly image2D direct_map;
layout(constant_id = ID_HAS_ENVIRONMENT) const bool HAS_ENVIRONMENT = true;
layout(push_constant) uniform DirectPush {
    uvec2 first;         // first texel of this rectangle in the surface's tile
    uint surface;
    uint receiver;       // of kind ATLAS: index among the mesh receivers
    uint light_count;
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "surface.glsl"
#include "atlas_samples.glsl"
#include "sampling.glsl"
#include "open_light.glsl"
#include "beam.glsl"
#include "lighting.glsl"
#include "light_of_points.glsl"

// The points of a texel's quarters. The next quarter replaces an empty one.
struct Quarters {
    uint triangles[4];
    vec3 x[4];
    vec3 n[4];
};

// Mean irradiance of the quarters over Light.power. They share the rays.
float quarters_irradiance(Light light, Quarters quarters) {
    float sum = 0.0;
    for (uint k = 0; k < POINT_LIGHT_RAYS; k++) {
        uint quarter = k % 4;
        sum += ray_irradiance(light, quarters.x[quarter], quarters.n[quarter], quarters.triangles[quarter], k, POINT_LIGHT_RAYS);
    }
    return sum / float(POINT_LIGHT_RAYS);
}

// The quarters of a texel, and whether it has any.
bool quarters_of(AtlasSamples points, out Quarters quarters, out vec3 of_environment) {
    of_environment = vec3(0.0);
    for (uint part = 0; part < 4; part++) {
        uint quarter = part;
        for (uint i = 0; i < 3 && points.triangles[quarter] == NO_TRIANGLE; i++) quarter = (quarter + 1) % 4;
        uint self = points.triangles[quarter];
        if (self == NO_TRIANGLE) return false;
        Triangle triangle = triangle_at(self);
        Normals corner = normals_at(self);
        vec2 w = unpackUnorm2x16(points.weights[quarter]);
        quarters.triangles[part] = self;
        quarters.x[part] = on_smooth_surface(triangle, corner, sample_point(points, int(quarter)), w);
        quarters.n[part] = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
        if (HAS_ENVIRONMENT) of_environment += light_of_points(triangle_points[self], w) / 4.0;
    }
    return true;
}

// Mean irradiance of the quarters from suns and lamps, W/m^2.
vec3 lights_irradiance(Quarters quarters) {
    vec3 centre = vec3(0.0);
    vec3 normal = vec3(0.0);
    for (uint part = 0; part < 4; part++) {
        centre += quarters.x[part] / 4.0;
        normal += quarters.n[part];
    }
    float radius = 0.0;
    for (uint part = 0; part < 4; part++) radius = max(radius, distance(quarters.x[part], centre));
    vec3 n = normalize(normal);
    vec3 a, b;
    basis(n, a, b);
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < push.light_count; i++) {
        Light light = light_at(i);
        LightDisc disc = disc_at(light, centre);
        // The beam decides for points that are all above the light's horizon.
        bool is_above = true;
        bool is_dark = true;
        float open = 0.0;
        for (uint part = 0; part < 4; part++) {
            vec3 own = quarters.n[part];
            is_above = is_above && !is_cut(disc, own) && dot(own, disc.direction) > 0.0;
            is_dark = is_dark && is_below(disc, own);
            open += open_irradiance(disc, own) / 4.0;
        }
        if (is_dark) continue;
        uint shade = trace_beam(beam_to(light, disc, centre, n, radius * a, radius * b, CURVATURE), true);
        if (shade == IS_LIT && is_above) sum += light.power * open;
        else if (shade != IS_DARK) sum += light.power * quarters_irradiance(light, quarters);
    }
    return sum;
}

void main() {
    DiffuseSurface surface = surface_at(push.surface);
    uvec2 texel = push.first + gl_GlobalInvocationID.xy;
    if (texel.x >= surface.width || texel.y >= surface.height) return;
    MeshReceiver receiver = mesh_receivers[push.receiver];
    Quarters quarters;
    vec3 sum;
    if (quarters_of(atlas_samples[receiver.first_texel + texel.x + texel.y * receiver.width], quarters, sum)) sum += lights_irradiance(quarters);
    imageStore(direct_map, ivec2(texel + uvec2(surface.tile_x, surface.tile_y)), vec4(sum, 0.0));
}
