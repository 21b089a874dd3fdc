// A triangle that is blurred by a parallelogram, in coordinates in which that is the unit square.

// The integral over y from 0 to 1 of x, clamped to 0 to 1, along the side from a to b; negative where the side runs
// toward -y. The sum over three sides is the area within the unit square (Green's theorem).
float side_integral(vec2 a, vec2 b) {
    // Always in the same direction, so that two triangles with a common side compute the same value.
    bool forward = a.y < b.y;
    vec2 low = forward ? a : b;
    vec2 high = forward ? b : a;
    float y0 = clamp(low.y, 0.0, 1.0);
    float y1 = clamp(high.y, 0.0, 1.0);
    if (y0 >= y1) return 0.0;
    float slope = (high.x - low.x) / (high.y - low.y);
    float first = low.x + (y0 - low.y) * slope;
    float last = low.x + (y1 - low.y) * slope;
    float x0 = min(first, last);
    float x1 = max(first, last);
    float c0 = clamp(x0, 0.0, 1.0);
    float c1 = clamp(x1, 0.0, 1.0);
    // Mean of the clamped x between x0 and x1: the part within 0 to 1, and the part above 1.
    float mean = c0;
    if (x1 - x0 > 1e-6) mean = (0.5 * (c1 - c0) * (c1 + c0) + max(x1 - max(x0, 1.0), 0.0)) / (x1 - x0);
    return (forward ? y1 - y0 : y0 - y1) * mean;
}

// Share of the unit square around the origin that the triangle between a, b and c covers.
float share_in_square(vec2 a, vec2 b, vec2 c) {
    return clamp(side_integral(a + 0.5, b + 0.5) + side_integral(b + 0.5, c + 0.5) + side_integral(c + 0.5, a + 0.5), 0.0, 1.0);
}

// Corner `i` of a parallelogram around the origin with these sides.
vec2 parallelogram_corner(vec2 a, vec2 b, uint i) {
    return 0.5 * ((i == 1 || i == 2 ? a : -a) + (i >= 2 ? b : -b));
}

// Share of a parallelogram around the origin that lies in the unit square around d, if `is_needed`: lavapipe runs the code of a branch that
// no thread takes, but not such a loop.
float parallelogram_value(vec2 a, vec2 b, vec2 d, bool is_needed) {
    vec2 from = 0.5 - d;
    vec2 last = from + parallelogram_corner(a, b, 3);
    float area = 0.0;
    for (uint i = 0; i < (is_needed ? 4 : 0); i++) {
        vec2 next = from + parallelogram_corner(a, b, i);
        area += side_integral(last, next);
        last = next;
    }
    return is_needed ? max(area / cross2(a, b), 0.0) : 0.0;
}

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
