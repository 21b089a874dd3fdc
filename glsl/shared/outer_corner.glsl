// The triangle around all texels that a blurred triangle touches. The including shader includes gpu_types.glsl and
// kernel.glsl.

// Half the width along the unit vector n of a texel and the points of a disc, which has this root, and somewhat more: rasterisation
// rounds.
float support(mat2 disc, vec2 n) {
    return 0.5 * (abs(n.x) + abs(n.y)) + POINT_DISTANCE * max(abs(dot(disc[0], n)), abs(dot(disc[1], n))) + 0.01;
}

// Corner `i` of the triangle q with every side moved outward by the unit square and the points of the disc. q is counter-clockwise.
vec2 outer_corner(vec2 q[3], mat2 disc, int i) {
    vec2 before = q[i] - q[(i + 2) % 3];
    vec2 after = q[(i + 1) % 3] - q[i];
    vec2 m = normalize(vec2(before.y, -before.x));
    vec2 n = normalize(vec2(after.y, -after.x));
    // The point where both moved sides meet.
    vec2 s = vec2(support(disc, m), support(disc, n));
    return q[i] + vec2(s.x * n.y - s.y * m.y, s.y * m.x - s.x * n.x) / cross2(m, n);
}

// The same of a splat that is a triangle, relative to its origin, in texels.
vec2 outer_corner(TriangleSplat splat, int i) {
    vec2 q[3] = vec2[](splat.corners01.xy, splat.corners01.zw, splat.corner2);
    mat2 m = mat2(splat.blur.xy, splat.blur.zw);
    return splat.points == IS_BLURRED ? inverse(m) * outer_corner(q, mat2(0.0), i) : outer_corner(q, m, i);
}
