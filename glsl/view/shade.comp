// shade: radiance of the listed pixels, of mirrors and interfaces and of several surfaces, where rays split at interfaces.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

#include "shade.glsl"
#include "media.glsl"

layout(std430, binding = 19) readonly buffer Spectrum { vec4 weights_below[]; }; // see spectrum.glsl

// Segments of a camera ray and of all rays that it splits into.
const int MAX_SEGMENTS = 32;
// Maximum number of pending rays.
const int MAX_WAITING = 6;

float brightness(Ray ray) {
    return dot(ray.weight, vec3(1.0));
}

// Places of pending rays are compared with constants: lavapipe writes to a variable place of an array lane by lane.
void put(inout Ray waiting[MAX_WAITING], int place, Ray ray) {
    for (int i = 0; i < MAX_WAITING; i++) {
        if (i == place) waiting[i] = ray;
    }
}

Ray waiting_at(Ray waiting[MAX_WAITING], int place) {
    Ray found = waiting[0];
    for (int i = 1; i < MAX_WAITING; i++) {
        if (i == place) found = waiting[i];
    }
    return found;
}

// Adds a pending ray, in place of the one of the least weight if there are too many.
void add(inout Ray waiting[MAX_WAITING], inout int count, Ray ray) {
    int least = 0;
    float weight = brightness(waiting[0]);
    for (int i = 1; i < MAX_WAITING; i++) {
        float own = brightness(waiting[i]);
        least = own < weight ? i : least;
        weight = min(own, weight);
    }
    if (count < MAX_WAITING) put(waiting, count++, ray);
    else if (weight < brightness(ray)) put(waiting, least, ray);
}

// Adds the light on a surface with this albedo.
void add_light(inout Seen sum, vec3 light, vec3 albedo, vec3 mean_albedo_) {
    sum.radiance += light * albedo;
    sum.untextured += luminance(light * mean_albedo_);
}

// What arrives at the camera from `direction`, where the first triangle is known, as light of one wavelength finds its way. `spread`
// is the angle of a sample, rad.
Seen traced(vec3 direction, uint first, float spread) {
    Seen sum = Seen(vec3(0.0), 0.0);
    Ray ray = Ray(push.eye, NO_TRIANGLE, direction, 0, vec3(1.0), uvec2(0), Cone(0.0, spread));
    Ray waiting[MAX_WAITING];
    int count = 0;
    Hit hit = hit_on(first, push.eye, direction);
    for (int segment = 0; segment < MAX_SEGMENTS; segment++) {
        bool ends = true;
        vec3 lamp;
        if (HAS_LAMPS && meets_lamp(ray.origin, ray.direction, hit.distance, lamp)) {
            add_light(sum, ray.weight * lamp, vec3(1.0), vec3(1.0));
        } else if (hit.triangle == NO_TRIANGLE) {
            add_light(sum, ray.weight * background(ray.direction, push.rotation, push.light_count), vec3(1.0), vec3(1.0));
        } else {
            Triangle triangle = triangle_at(hit.triangle);
            Object object = object_at(triangle.object);
            vec3 geometric = normalize(cross(triangle.edge1, triangle.edge2));
            bool front = dot(geometric, ray.direction) < 0.0;
            vec2 w = hit.barycentric;
            vec3 x = triangle.position + w.x * triangle.edge1 + w.y * triangle.edge2;
            if (object.kind == DIFFUSE) {
                if (front) {
                    vec3 absorption = filling(ray.media).absorption;
                    vec3 albedo = albedo_at(object, hit.triangle, triangle, w, ray.direction, abs(widened(ray.cone, hit.distance).width));
                    vec3 light = ray.weight * exp(-hit.distance * absorption) / PI * irradiance(triangle.object, hit.triangle, x, w);
                    add_light(sum, light, albedo, mean_albedo(object, hit.triangle));
                }
            } else if ((front || object.kind == DIELECTRIC) && ray.bounces < MAX_BOUNCES) {
                uvec2 before, behind;
                media_at(ray.media, object, front, before, behind);
                Medium from = filling(before);
                Medium to = filling(behind);
                if (from.absorption != vec3(0.0)) ray.weight *= exp(-hit.distance * from.absorption);
                if (is_body(object) && from.number == to.number) {
                    // One body ends within another.
                    ray = Ray(x, hit.triangle, ray.direction, ray.bounces, ray.weight, behind, widened(ray.cone, hit.distance));
                    hit = next_hit(ray);
                    continue;
                }
                Normals corner = normals_at(hit.triangle);
                vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
                float eta = is_body(object) ? from.ior / to.ior : eta_of(object, front);
                if (!front) {
                    n = -n;
                    geometric = -geometric;
                }
                // Where the interpolated normal would reflect the ray into the surface, the geometric normal replaces
                // it.
                if (!(dot(mirrored(-ray.direction, n), geometric) > 0.0)) n = geometric;
                Cone cone = widened(ray.cone, hit.distance);
                float curvature = HAS_TEXTURES ? (front ? 1.0 : -1.0) * mean_curvature(triangle, corner) : 0.0;
                vec3 share = reflected_share(object, dot(n, -ray.direction), eta);
                Ray reflected = Ray(x, hit.triangle, mirrored(-ray.direction, n), ray.bounces + 1, ray.weight * share, before, reflected_cone(cone, curvature));
                vec3 refracted = eta == 0.0 ? vec3(0.0) : outgoing_direction(-ray.direction, n, eta);
                Cone bent = refracted_cone(cone, curvature, dot(n, -ray.direction), eta);
                Ray through = Ray(x, hit.triangle, refracted, ray.bounces + 1, ray.weight * (1.0 - share) * eta * eta, behind, bent);
                bool passes = refracted != vec3(0.0) && any(greaterThan(through.weight, vec3(MIN_WEIGHT)));
                bool returns = any(greaterThan(reflected.weight, vec3(MIN_WEIGHT)));
                bool through_first = passes && (!returns || brightness(through) >= brightness(reflected));
                ray = through_first ? through : reflected;
                if (passes && returns) add(waiting, count, through_first ? reflected : through);
                ends = !passes && !returns;
            }
        }
        // The pending ray of the largest weight is next, so that the rays that are left in the end matter least.
        int next = -1;
        float weight = ends ? -1.0 : brightness(ray);
        for (int i = 0; i < MAX_WAITING; i++) {
            float own = i < count ? brightness(waiting[i]) : -1.0;
            next = own > weight ? i : next;
            weight = max(own, weight);
        }
        if (next < 0 && ends) break;
        if (next >= 0) {
            Ray found = waiting_at(waiting, next);
            // The last one, or the ray that is put off, takes its place.
            Ray moved = waiting_at(waiting, count - 1);
            if (!ends) moved = ray;
            put(waiting, next, moved);
            count -= ends ? 1 : 0;
            ray = found;
        }
        hit = next_hit(ray);
    }
    return sum;
}

// The same, where media disperse light: each channel at the mean of its wavelengths.
Seen seen_in(vec3 direction, uint first, float spread) {
    Seen sum = Seen(vec3(0.0), 0.0);
    int channels = 1;
    if (DISPERSES) channels = 3;
    for (int channel = 0; channel < channels; channel++) {
        if (DISPERSES) spectral_offset = weights_below[channel].w;
        Seen found = traced(direction, first, spread);
        if (DISPERSES) {
            sum.radiance[channel] = found.radiance[channel];
            sum.untextured += found.untextured / float(channels);
        } else sum = found;
    }
    return sum;
}

#include "shade_pixels.glsl"
