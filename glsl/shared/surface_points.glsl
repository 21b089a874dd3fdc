// Points of meshes where direct light is computed. The including shader declares the buffers `triangles` and `normals` and includes
// surface.glsl.

// Place and unit normal of a point.
void locate(SurfacePoint point, out vec3 x, out vec3 n) {
    Triangle triangle = triangle_at(point.triangle);
    Normals corner = normals_at(point.triangle);
    // Rays from a corner or an edge would meet the triangles beside it.
    vec2 w = mix(unpackUnorm2x16(point.weights), vec2(1.0 / 3.0), 0.02);
    x = triangle.position + w.x * triangle.edge1 + w.y * triangle.edge2;
    n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
    x = on_smooth_surface(triangle, corner, x, w);
}
