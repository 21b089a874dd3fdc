// shade: the camera's view. Diffuse surfaces show direct light, and caustics where they have a light map. Mirrors show
// reflections; dielectrics also show what is behind them.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
OBJECTS(3)
LIGHTS(4)
PLANAR_RECEIVERS(5)
layout(binding = 6) uniform sampler2D environment;
layout(binding = 7) uniform sampler2D light_map;   // caustic irradiance
layout(binding = 8) uniform sampler2D direct_map;  // irradiance from the environment
layout(binding = 9, rgba32f) uniform writeonly image2D view;
layout(std430, binding = 10) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(push_constant) uniform ShadePush {
    vec3 eye;
    uint light_count;
    vec3 right;          // half the picture's width at distance 1
    uint has_environment;
    vec3 up;             // half the picture's height at distance 1
    float rotation;
    vec3 forward;        // unit
    uint side;           // side^2 samples per pixel
    uvec2 first;         // first pixel of this rectangle
} push;

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "mesh_receiver.glsl"
#include "sampling.glsl"
#include "environment.glsl"
#include "lighting.glsl"

const int MAX_BOUNCES = 12;
// Segments of a camera ray and of all rays that it splits into.
const int MAX_SEGMENTS = 32;
// Capacity of the stack of pending rays.
const int MAX_WAITING = 6;
// Rays with a smaller weight are dropped.
const float MIN_WEIGHT = 1e-6;
// rad; camera rays do not meet a smaller disc.
const float MIN_DISC = 1e-6;

// Bilinear look-up that stays inside a receiver's tile.
vec3 look_up(sampler2D map, vec2 tile, vec2 size, vec2 texel) {
    vec2 low = tile + 0.5;
    vec2 high = low + size - 1.0;
    return textureLod(map, clamp(texel, low, high) / vec2(textureSize(map, 0)), 0.0).rgb;
}

// The point on the smooth surface that a triangle approximates: x is projected onto each corner's tangent plane where
// it lies below the plane, and the results are interpolated (Hanika 2021, "Hacking the Shadow Terminator"). Rays that
// start there do not meet the triangle's neighbours where the interpolated normal faces the light.
vec3 on_smooth_surface(Triangle triangle, Normals corner, vec3 x, vec2 weights) {
    vec3 from = x - triangle.position;
    return x
        - (1.0 - weights.x - weights.y) * min(dot(from, corner.n0), 0.0) * corner.n0
        - weights.x * min(dot(from - triangle.edge1, corner.n1), 0.0) * corner.n1
        - weights.y * min(dot(from - triangle.edge2, corner.n2), 0.0) * corner.n2;
}

vec3 diffuse_irradiance(Object object, vec3 x, vec3 n, uint self, vec2 weights, uint pixel_sample) {
    uint parts = push.side * push.side;
    uint rays = (VIEW_LIGHT_RAYS + parts - 1) / parts;
    vec3 lit = on_smooth_surface(triangle_at(self), normals_at(self), x, weights);
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < push.light_count; i++) sum += direct_light(i, lit, n, self, pixel_sample, rays, parts);
    if (object.receiver != NO_RECEIVER) {
        vec2 tile, size, texel;
        if (object.is_mesh != 0) {
            MeshReceiver receiver = mesh_receivers[object.receiver];
            tile = vec2(receiver.tile_x, receiver.tile_y);
            size = vec2(receiver.width, receiver.height);
            texel = tile + light_map_position(receiver, normals_at(self), weights);
        } else {
            PlanarReceiver receiver = planar_receiver_at(object.receiver);
            tile = vec2(receiver.tile_x, receiver.tile_y);
            size = vec2(receiver.width, receiver.height);
            texel = to_texels(receiver, x);
        }
        sum += look_up(light_map, tile, size, texel);
        if (push.has_environment != 0) sum += look_up(direct_map, tile, size, texel);
    } else if (push.has_environment != 0) {
        sum += direct_environment(lit, n, self, 0, 1, VIEW_ENVIRONMENT_RAYS, push.rotation);
    }
    return sum;
}

// Radiance of suns and environment, W/m^2/sr.
vec3 background(vec3 direction) {
    vec3 seen = push.has_environment != 0 ? environment_radiance(direction, push.rotation, 0.0) : vec3(0.0);
    for (uint i = 0; i < push.light_count; i++) {
        if (light_at(i).is_lamp != 0) continue;
        // Compares chords, because the cosine of a small angle rounds to 1.
        float radius = light_at(i).size;
        bool inside = distance(direction, light_at(i).place) < 2.0 * sin(0.5 * radius);
        float sine = sin(radius);
        if (inside && radius > MIN_DISC) seen += light_at(i).power / (PI * sine * sine);
    }
    return seen;
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

// A pending ray.
struct Ray {
    vec3 origin;
    uint self;
    vec3 direction;
    int bounces;
    vec3 weight;
};

// Radiance that arrives from `direction`, W/m^2/sr.
vec3 radiance(vec3 origin, vec3 direction, uint pixel_sample) {
    vec3 sum = vec3(0.0);
    Ray ray = Ray(origin, NO_TRIANGLE, direction, 0, vec3(1.0));
    Ray waiting[MAX_WAITING];
    int count = 0;
    for (int segment = 0; segment < MAX_SEGMENTS; segment++) {
        bool ends = true;
        Hit hit = nearest(ray.origin, ray.direction, ray.self, ANY_TRIANGLE);
        vec3 lamp;
        if (meets_lamp(ray.origin, ray.direction, hit.distance, lamp)) {
            sum += ray.weight * lamp;
        } else if (hit.triangle == NO_TRIANGLE) {
            sum += ray.weight * background(ray.direction);
        } else {
            Triangle triangle = triangle_at(hit.triangle);
            Object object = object_at(triangle.object);
            vec3 geometric = normalize(cross(triangle.edge1, triangle.edge2));
            bool front = dot(geometric, ray.direction) < 0.0;
            Normals corner = normals_at(hit.triangle);
            vec2 w = hit.barycentric;
            vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
            vec3 x = triangle.position + w.x * triangle.edge1 + w.y * triangle.edge2;
            if (object.kind == DIFFUSE) {
                if (front) sum += ray.weight * object.color / PI * diffuse_irradiance(object, x, n, hit.triangle, w, pixel_sample);
            } else if ((front || object.kind == DIELECTRIC) && ray.bounces < MAX_BOUNCES) {
                float eta = eta_of(object, front);
                if (!front) {
                    n = -n;
                    geometric = -geometric;
                }
                // Where the interpolated normal would reflect the ray into the surface, the geometric normal replaces
                // it.
                if (!(dot(mirrored(-ray.direction, n), geometric) > 0.0)) n = geometric;
                vec3 share = reflected_share(object, dot(n, -ray.direction), eta);
                vec3 refracted = eta == 0.0 ? vec3(0.0) : outgoing_direction(-ray.direction, n, eta);
                Ray through = Ray(x, hit.triangle, refracted, ray.bounces + 1, ray.weight * (1.0 - share) * eta * eta);
                ray = Ray(x, hit.triangle, mirrored(-ray.direction, n), ray.bounces + 1, ray.weight * share);
                bool passes = refracted != vec3(0.0) && any(greaterThan(through.weight, vec3(MIN_WEIGHT)));
                bool returns = any(greaterThan(ray.weight, vec3(MIN_WEIGHT)));
                // The ray of larger weight continues; the other is pushed where the stack has space.
                bool swaps = passes && (!returns || dot(through.weight, vec3(1.0)) >= dot(ray.weight, vec3(1.0)));
                if (passes && returns && count < MAX_WAITING) waiting[count++] = swaps ? ray : through;
                if (swaps) ray = through;
                ends = !passes && !returns;
            }
        }
        if (ends) {
            if (count == 0) break;
            ray = waiting[--count];
        }
    }
    return sum;
}

void main() {
    uvec2 size = imageSize(view);
    uvec2 pixel = push.first + gl_GlobalInvocationID.xy;
    if (pixel.x >= size.x || pixel.y >= size.y) return;
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < push.side * push.side; i++) {
        vec2 within = (vec2(i % push.side, i / push.side) + 0.5) / float(push.side);
        vec2 p = (vec2(pixel) + within) / vec2(size) * 2.0 - 1.0;
        vec3 direction = normalize(push.forward + p.x * push.right - p.y * push.up);
        sum += radiance(push.eye, direction, i) / float(push.side * push.side);
    }
    imageStore(view, ivec2(pixel), vec4(sum, 1.0));
}
