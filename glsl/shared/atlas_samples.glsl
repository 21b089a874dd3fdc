// Points on a mesh receiver's surface for a texel. The including shader declares the buffer `triangles`.

vec3 sample_point(AtlasSamples points, int quarter) {
    Triangle triangle = triangle_at(points.triangles[quarter]);
    vec2 weights = unpackUnorm2x16(points.weights[quarter]);
    return triangle.position + weights.x * triangle.edge1 + weights.y * triangle.edge2;
}
