// Merged triangles of casters, which are curved: quadratic functions through corners and midpoints. The including shader declares the
// buffer `triangles`.

layout(constant_id = ID_HAS_MERGED) const bool HAS_MERGED = false;

bool is_merged(Triangle triangle) {
    return HAS_MERGED && (triangle.flags & MERGED) != 0;
}

// Of the sides 01, 12 and 20: 4 times what the position in the middle has beyond the mean of the corners', m.
vec3[3] bulges_of(Triangle triangle) {
    vec3 bulges[3] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0));
    if (HAS_MERGED) {
        Triangle middle = triangle_at(triangle.twin);
        float scale = is_merged(triangle) ? 4.0 : 0.0;
        vec3 at = triangle.position;
        bulges[0] = scale * (middle.position - at - 0.5 * triangle.edge1);
        bulges[1] = scale * (middle.position + middle.edge1 - at - 0.5 * (triangle.edge1 + triangle.edge2));
        bulges[2] = scale * (middle.position + middle.edge2 - at - 0.5 * triangle.edge2);
    }
    return bulges;
}

// The quadratic function that is a fourth of `bulges` in the middle of the sides, and 0 at the corners.
vec3 bulge_at(vec3 bulges[3], vec2 st) {
    float first = 1.0 - st.x - st.y;
    return first * st.x * bulges[0] + st.x * st.y * bulges[1] + st.y * first * bulges[2];
}
