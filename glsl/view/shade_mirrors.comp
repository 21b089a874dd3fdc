// shade mirrors: does what shade.comp does where no surface of the scene refracts, so that rays do not split.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

#include "shade.glsl"

// What arrives at the camera from `direction`, where the first triangle is known. Light is looked up once,
// where the last ray ends. `spread` is the angle of a sample, rad.
Seen seen_in(vec3 direction, uint first, float spread) {
    Ray ray = Ray(push.eye, NO_TRIANGLE, direction, 0, vec3(1.0), uvec2(0), Cone(0.0, spread));
    Hit hit = hit_on(first, push.eye, direction);
    Triangle triangle;
    Object object;
    vec3 lamp = vec3(0.0);
    bool shows_lamp = false;
    bool is_lit = false;
    bool is_specular = true;
    while (is_specular) {
        triangle = triangle_at(hit.triangle == NO_TRIANGLE ? 0 : hit.triangle);
        object = object_at(triangle.object);
        vec3 geometric = normalize(cross(triangle.edge1, triangle.edge2));
        is_lit = dot(geometric, ray.direction) < 0.0;
        if (HAS_LAMPS) shows_lamp = meets_lamp(ray.origin, ray.direction, hit.distance, lamp);
        is_specular = is_lit && !shows_lamp && hit.triangle != NO_TRIANGLE && object.kind != DIFFUSE;
        if (is_specular) {
            vec2 w = hit.barycentric;
            Normals corner = normals_at(hit.triangle);
            vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
            // Where the interpolated normal would reflect the ray into the surface, the geometric normal replaces it.
            if (!(dot(mirrored(-ray.direction, n), geometric) > 0.0)) n = geometric;
            if (HAS_TEXTURES) ray.cone = reflected_cone(widened(ray.cone, hit.distance), mean_curvature(triangle, corner));
            ray.weight *= reflected_share(object, dot(n, -ray.direction), 0.0);
            ray.origin = triangle.position + w.x * triangle.edge1 + w.y * triangle.edge2;
            ray.direction = mirrored(-ray.direction, n);
            ray.self = hit.triangle;
            ray.bounces++;
            // A ray that ends here is black.
            is_lit = ray.bounces <= MAX_BOUNCES && any(greaterThan(ray.weight, vec3(MIN_WEIGHT)));
            is_specular = is_lit;
            if (is_lit) hit = next_hit(ray);
        }
    }
    vec3 seen = vec3(0.0);
    vec3 untextured_ = vec3(0.0);
    if (shows_lamp) {
        seen = untextured_ = lamp;
    } else if (hit.triangle == NO_TRIANGLE) {
        seen = untextured_ = background(ray.direction, push.rotation, push.light_count);
    } else if (is_lit && object.kind == DIFFUSE) {
        vec2 w = hit.barycentric;
        vec3 x = triangle.position + w.x * triangle.edge1 + w.y * triangle.edge2;
        float width = abs(widened(ray.cone, hit.distance).width);
        vec3 light = irradiance(triangle.object, hit.triangle, x, w) / PI;
        seen = albedo_at(object, hit.triangle, triangle, w, ray.direction, width) * light;
        untextured_ = mean_albedo(object, hit.triangle) * light;
    }
    return Seen(ray.weight * seen, luminance(ray.weight * untextured_));
}

#include "shade_pixels.glsl"
