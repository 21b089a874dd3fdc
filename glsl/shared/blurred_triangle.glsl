// The triangle around all texels that a blurred triangle touches.

// Half the width of the unit square along the unit vector n, and somewhat more: rasterisation rounds.
float support(vec2 n) {
    return 0.5 * (abs(n.x) + abs(n.y)) + 0.01;
}

// Corner `i` of the triangle q with every side moved outward by the unit square that blurs it. q is counter-clockwise.
vec2 outer_corner(vec2 q[3], int i) {
    vec2 before = q[i] - q[(i + 2) % 3];
    vec2 after = q[(i + 1) % 3] - q[i];
    vec2 m = normalize(vec2(before.y, -before.x));
    vec2 n = normalize(vec2(after.y, -after.x));
    // The point where both moved sides meet.
    vec2 s = vec2(support(m), support(n));
    return q[i] + vec2(s.x * n.y - s.y * m.y, s.y * m.x - s.x * n.x) / cross2(m, n);
}
