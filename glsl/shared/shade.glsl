// What rays of the camera show: light in the maps of diffuse surfaces, lamps, the background. For shade.comp and
// shade_mirrors.comp.

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
OBJECTS(3)
LIGHTS(4)
SURFACES(5)
layout(binding = 6) uniform sampler2D environment;
layout(binding = 7) uniform sampler2D light_map;   // caustic irradiance
layout(binding = 8) uniform sampler2D direct_map;  // direct irradiance
layout(binding = 9, rgba32f) uniform writeonly image2D view;
layout(std430, binding = 10) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 11) readonly buffer TrianglePointsBuffer { TrianglePoints triangle_points[]; };
layout(std430, binding = 12) readonly buffer PointLight { vec4 point_light[]; };
layout(binding = 13) uniform usampler2D visible;   // triangles at the samples of this tile of the picture
layout(std430, binding = 14) readonly buffer Counts { uint counts[]; };
layout(std430, binding = 15) readonly buffer Pixels { uint pixels[]; };
TEXTURED_TRIANGLES(16)
TEXTURE_LEVELS(17)
layout(binding = 18) uniform sampler2D textures;

// What the scene has. The compiler removes code that the scene does not need.
layout(constant_id = ID_HAS_LAMPS) const bool HAS_LAMPS = true;
layout(constant_id = ID_HAS_ENVIRONMENT) const bool HAS_ENVIRONMENT = true;
layout(constant_id = ID_HAS_ATLAS) const bool HAS_ATLAS = true;
layout(constant_id = ID_HAS_POINTS) const bool HAS_POINTS = true;

#include "view_ray.glsl"
UNTEXTURED(20, writeonly)
#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "mesh_receiver.glsl"
#include "surface.glsl"
#include "look_up.glsl"
#include "light_of_points.glsl"
#include "environment.glsl"
#include "background.glsl"
#include "texture.glsl"
#include "cone.glsl"
#include "work_list.glsl"

const int MAX_BOUNCES = 12;
// Rays with a smaller weight are dropped. Measured against 1e-6 on glass: L1 0.01 to 0.03 %, 60 to 80 % of the time.
const float MIN_WEIGHT = 1e-3;

// Direct light and caustic at a point of a diffuse object, W/m^2.
vec3 irradiance(uint object, uint index, vec3 x, vec2 weights) {
    DiffuseSurface surface = surface_at(object);
    if (HAS_POINTS && surface.kind == POINTS) return light_of_points(triangle_points[index], weights);
    vec2 tile = vec2(surface.tile_x, surface.tile_y);
    vec2 size = vec2(surface.width, surface.height);
    if (HAS_ATLAS && surface.kind == ATLAS) {
        MeshReceiver receiver = mesh_receivers[object_at(object).receiver];
        vec2 texel = light_map_position(receiver, normals_at(index), weights);
        vec2 light_tile = vec2(receiver.tile_x, receiver.tile_y);
        return look_up(direct_map, tile, size, tile + texel) + look_up(light_map, light_tile, size, light_tile + texel);
    }
    vec2 texel = to_texels(plane_of(surface), x);
    vec3 sum = look_up(direct_map, tile, size, texel);
    if (surface.light_width > 0) {
        vec2 light_tile = vec2(surface.light_x, surface.light_y);
        vec2 light_size = vec2(surface.light_width, surface.light_height);
        sum += look_up_smooth(light_map, light_tile, light_size, light_tile + (texel - tile) * (light_size / size));
    }
    return sum;
}

// Whether a ray meets a lamp before `limit`, and the radiance of the nearest lamp, W/m^2/sr. Lamps hide objects behind
// them from the camera, but cast no shadows.
bool meets_lamp(vec3 origin, vec3 direction, float limit, out vec3 seen) {
    bool meets = false;
    for (uint i = 0; i < push.light_count; i++) {
        Light light = light_at(i);
        LightDisc disc = disc_at(light, origin);
        if (light.is_lamp == 0 || disc.angular_radius <= MIN_DISC) continue;
        float along = dot(light.place - origin, direction);
        vec3 aside = light.place - origin - along * direction;
        bool inside = along > 0.0 && dot(aside, aside) < light.size * light.size;
        float lamp_distance = distance_to_light(light, origin, direction);
        if (inside && lamp_distance < limit) {
            limit = lamp_distance;
            meets = true;
            seen = light.power / (PI * light.size * light.size);
        }
    }
    return meets;
}

// Radiance of a sample, and its luminance with the mean colours of textures in place of their detail, W/m^2/sr.
struct Seen {
    vec3 radiance;
    float untextured;
};

// Luminance of linear sRGB (IEC 61966-2-1).
float luminance(vec3 rgb) {
    return dot(rgb, vec3(0.2126, 0.7152, 0.0722));
}

// A pending ray.
struct Ray {
    vec3 origin;
    uint self;
    vec3 direction;
    int bounces;
    vec3 weight;
    uvec2 media;     // see media.glsl
    Cone cone;
};

// The next hit of a ray. Rays that start on the edge of a triangle would meet its neighbour there again, because of rounding: hits
// nearer than a millionth of the scene's size do not count.
Hit next_hit(Ray ray) {
    vec3 scale = grid_of_nodes().scale;
    float nearest_distance = 0.065 / min(scale.x, min(scale.y, scale.z));
    Hit hit;
    float passed = 0.0;
    for (int i = 0; i < 2; i++) {
        hit = nearest(ray.origin + passed * ray.direction, ray.direction, ray.self, ANY_TRIANGLE);
        hit.distance += passed;
        if (hit.distance > nearest_distance) break;
        passed = nearest_distance;
    }
    return hit;
}

// The hit of a ray on the surface around a triangle that it is known to meet within a pixel.
Hit hit_on(uint number, vec3 origin, vec3 direction) {
    if (number == NO_TRIANGLE) return Hit(FAR, NO_TRIANGLE, vec2(0.0));
    uint index = number & ~BY_RAYS;
    Triangle triangle = triangle_at(index);
    vec3 p = cross(direction, triangle.edge2);
    vec3 s = origin - triangle.position;
    vec3 q = cross(s, triangle.edge1);
    float determinant = dot(triangle.edge1, p);
    // Seen edge on, any point of the triangle will do.
    if (determinant == 0.0) return Hit(length(s), index, vec2(0.0));
    vec2 w = vec2(dot(s, p), dot(direction, q)) / determinant;
    // Approximately the nearest point of the triangle: rays that start beside the triangle might start within the object.
    vec2 inside = max(w, 0.0);
    bool is_rect = triangle.twin != index;
    return Hit(dot(triangle.edge2, q) / determinant, index, is_rect ? w : inside / max(inside.x + inside.y, 1.0));
}
