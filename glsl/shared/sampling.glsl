// Low-discrepancy points. The including shader includes light.glsl.

const float GOLDEN_ANGLE = 2.39996322972865;

// Point i of n of a spiral that covers the unit disc evenly (Vogel 1979).
vec2 disc_point(uint i, uint n) {
    float angle = float(i) * GOLDEN_ANGLE;
    return sqrt((float(i) + 0.5) / float(n)) * vec2(cos(angle), sin(angle));
}

// Unit direction toward the point `p` of the unit disc, mapped to a light's disc. The map is uniform in the projected
// disc, so the radiance is constant.
vec3 disc_direction(LightDisc disc, vec2 p) {
    vec3 a, b;
    basis(disc.direction, a, b);
    vec2 q = p * sin(disc.angular_radius);
    return normalize(disc.direction * sqrt(max(1.0 - dot(q, q), 0.0)) + q.x * a + q.y * b);
}

// Weight of the direction s drawn by disc_direction(): Light.power times the weight is the irradiance of a plane that
// faces s. The solid angle of an element of the projected disc is its area over the cosine to the centre. Lamps may be
// wide; for suns the cosine is omitted, an error of 0.05 % at 2.5 degrees.
float disc_weight(LightDisc disc, vec3 s) {
    return disc.inverse_distance > 0.0 ? disc.falloff / dot(disc.direction, s) : disc.falloff;
}
