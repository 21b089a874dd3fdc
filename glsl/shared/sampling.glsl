// Low-discrepancy points.

const float GOLDEN_ANGLE = 2.39996322972865;

// Point i of n of a spiral that covers the unit disc evenly (Vogel 1979).
vec2 disc_point(uint i, uint n) {
    float angle = float(i) * GOLDEN_ANGLE;
    return sqrt((float(i) + 0.5) / float(n)) * vec2(cos(angle), sin(angle));
}

// Unit direction toward point `p` of the unit disc, spread over a sun's disc: the projected disc
// is even, so its radiance is constant.
vec3 sun_direction(vec3 centre, float angular_radius, vec2 p) {
    vec3 a, b;
    basis(centre, a, b);
    vec2 q = p * sin(angular_radius);
    return normalize(centre * sqrt(max(1.0 - dot(q, q), 0.0)) + q.x * a + q.y * b);
}
