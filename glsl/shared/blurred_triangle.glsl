// A triangle that is blurred by unit squares: by a texel around each of several points, or, in coordinates in which it is the unit square, by
// a parallelogram.

// A side, always in the same direction, so that two triangles with a common side compute the same value.
struct Side {
    vec2 low;
    vec2 high;
    float slope;
    bool forward; // whether it ran toward +y
};

Side side_between(vec2 a, vec2 b) {
    bool forward = a.y < b.y;
    vec2 low = forward ? a : b;
    vec2 high = forward ? b : a;
    return Side(low, high, (high.x - low.x) / (high.y - low.y), forward);
}

// The integral over y from 0 to 1 of x, clamped to 0 to 1, along the side, seen from `origin`; negative where the side ran toward
// -y. The sum over three sides is the area within the unit square (Green's theorem).
float side_integral(Side side, vec2 origin) {
    vec2 low = side.low - origin;
    float y0 = clamp(low.y, 0.0, 1.0);
    float y1 = clamp(side.high.y - origin.y, 0.0, 1.0);
    if (y0 >= y1) return 0.0;
    float first = low.x + (y0 - low.y) * side.slope;
    float last = low.x + (y1 - low.y) * side.slope;
    float x0 = min(first, last);
    float x1 = max(first, last);
    float c0 = clamp(x0, 0.0, 1.0);
    float c1 = clamp(x1, 0.0, 1.0);
    // Mean of the clamped x between x0 and x1: the part within 0 to 1, and the part above 1.
    float mean = c0;
    if (x1 - x0 > 1e-6) mean = (0.5 * (c1 - c0) * (c1 + c0) + max(x1 - max(x0, 1.0), 0.0)) / (x1 - x0);
    return (side.forward ? y1 - y0 : y0 - y1) * mean;
}

// Share of the unit square around `centre` that lies between the sides of a triangle.
float share_in_square(Side sides[3], vec2 centre) {
    vec2 origin = centre - 0.5;
    return clamp(side_integral(sides[0], origin) + side_integral(sides[1], origin) + side_integral(sides[2], origin), 0.0, 1.0);
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
        area += side_integral(side_between(last, next), vec2(0.0));
        last = next;
    }
    return is_needed ? max(area / cross2(a, b), 0.0) : 0.0;
}
