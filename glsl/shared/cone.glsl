// Cones around rays of the camera, as wide as a sample, which textures are filtered over (Akenine-Moeller et al. 2021). The
// including shader declares TEXTURED_TRIANGLES and includes optics.glsl and texture.glsl.

struct Cone {
    float width;     // at the ray's origin, m; negative beyond a focus
    float spread;    // growth of the width with distance
};

// Mean curvature of the surface that the normals interpolate, 1/m; positive where it is convex.
float mean_curvature(Triangle triangle, Normals corner) {
    vec3 area = cross(triangle.edge1, triangle.edge2);
    float trace = dot(cross(triangle.edge2, area), corner.n1 - corner.n0) + dot(cross(area, triangle.edge1), corner.n2 - corner.n0);
    return 0.5 * trace / dot(area, area);
}

// The cone at the end of a ray of length `distance_`.
Cone widened(Cone cone, float distance_) {
    return Cone(cone.width + cone.spread * distance_, cone.spread);
}

// The cone at its hit, reflected. `curvature` is the mean curvature as the ray sees it.
Cone reflected_cone(Cone cone, float curvature) {
    return Cone(cone.width, cone.spread + 2.0 * curvature * cone.width);
}

// The same, refracted. `cosine` is that of the angle between the ray and the normal.
Cone refracted_cone(Cone cone, float curvature, float cosine, float eta) {
    float cos_t = sqrt(max(1.0 - eta * eta * (1.0 - cosine * cosine), 0.0));
    // Change of the direction over that of the normal.
    float change = (eta * cosine - cos_t) / max(cosine, 0.05);
    return Cone(cone.width, eta * cone.spread + change * curvature * cone.width);
}

// Change of texture coordinates with a position in the triangle's plane.
vec2 texture_change(Triangle triangle, TexturedTriangle texture_, vec3 change) {
    vec3 area = cross(triangle.edge1, triangle.edge2);
    float u = dot(cross(change, triangle.edge2), area) / dot(area, area);
    float v = dot(cross(triangle.edge1, change), area) / dot(area, area);
    return u * (texture_.uv1 - texture_.uv0) + v * (texture_.uv2 - texture_.uv0);
}

// The mean albedo of a diffuse surface.
vec3 mean_albedo(Object object, uint index) {
    vec3 albedo = object.color;
    if (HAS_TEXTURES) {
        TexturedTriangle texture_ = textured_triangle_at(index);
        if (texture_.level_count > 0) albedo *= mean_colour(texture_.first_level, texture_.level_count);
    }
    return albedo;
}

// Albedo of a diffuse surface where a ray meets it; `weights` are of the second and third corner.
vec3 albedo_at(Object object, uint index, Triangle triangle, vec2 weights, vec3 direction, float width) {
    vec3 albedo = object.color;
    if (HAS_TEXTURES) {
        TexturedTriangle texture_ = textured_triangle_at(index);
        if (texture_.level_count > 0) {
            vec2 uv = texture_.uv0 + weights.x * (texture_.uv1 - texture_.uv0) + weights.y * (texture_.uv2 - texture_.uv0);
            // The cone's ellipse on the surface.
            vec3 n = normalize(cross(triangle.edge1, triangle.edge2));
            vec3 along = direction - dot(direction, n) * n;
            vec3 across;
            if (dot(along, along) < 1e-8) basis(n, along, across);
            else {
                along = normalize(along);
                across = cross(n, along);
            }
            along *= width / max(abs(dot(direction, n)), 0.01);
            across *= width;
            vec2 along_uv = texture_change(triangle, texture_, along);
            vec2 across_uv = texture_change(triangle, texture_, across);
            albedo *= colour_of_texture(texture_.first_level, texture_.level_count, uv, along_uv, across_uv);
        }
    }
    return albedo;
}
