// Low-discrepancy points. The including shader includes sun.glsl.

const float GOLDEN_ANGLE = 2.39996322972865;

// Point i of n of a spiral that covers the unit disc evenly (Vogel 1979).
vec2 disc_point(uint i, uint n) {
    float angle = float(i) * GOLDEN_ANGLE;
    return sqrt((float(i) + 0.5) / float(n)) * vec2(cos(angle), sin(angle));
}

// Unit direction toward point `p` of the unit disc, spread over a sun's disc: the projected disc
// is even, so its radiance is constant.
vec3 disc_direction(LightDisc disc, vec2 p) {
    vec3 a, b;
    basis(disc.direction, a, b);
    vec2 q = p * sin(disc.angular_radius);
    return normalize(disc.direction * sqrt(max(1.0 - dot(q, q), 0.0)) + q.x * a + q.y * b);
}

// What the direction s, drawn so, counts: Light.power times this on a plane across s. The solid angle
// of a part of the projected disc is its area over the cosine to the middle. Lamps may be wide; for
// suns it is left out, which is 0.05 % at 2.5 degrees.
float disc_weight(LightDisc disc, vec3 s) {
    return disc.inverse_distance > 0.0 ? disc.falloff / dot(disc.direction, s) : disc.falloff;
}
