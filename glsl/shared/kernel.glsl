// Covariances as (xx, xy, yy), and the kernel with which a patch spreads its flux.

float determinant2(vec3 m) {
    return m.x * m.z - m.y * m.y;
}

vec3 inverse2(vec3 m) {
    return vec3(m.z, -m.y, m.x) / determinant2(m);
}

vec3 outer2(vec2 v) {
    return vec3(v.x * v.x, v.x * v.y, v.y * v.y);
}

// d^T m d
float quadratic2(vec3 m, vec2 d) {
    return m.x * d.x * d.x + 2.0 * m.y * d.x * d.y + m.z * d.y * d.y;
}

// Trace of a b.
float trace2(vec3 a, vec3 b) {
    return a.x * b.x + 2.0 * a.y * b.y + a.z * b.z;
}

// K(d) = peak (1 - t^inner)^outer, t = d^T conic d < 1: without the peak.
float kernel_value(float inner, float outer, float t) {
    if (t >= 1.0) return 0.0;
    float base = 1.0 - (inner == 1.0 ? t : pow(t, inner));
    if (outer == 4.0) return base * base * base * base;
    return outer == 1.5 ? base * sqrt(base) : pow(base, outer);
}
