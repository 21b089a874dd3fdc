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

// The kernel at t = d^T conic d, of integral pi mean / sqrt(det conic): (1 - t)^p for a shape
// p >= 1.5, and, flatter, (1 - t^n)^1.5 for a shape -n <= -1.
float kernel_value(float shape, float t) {
    // x^y as exp2(y log2 x): pow() is slow on some drivers.
    bool flat_top = shape < 0.0;
    float base = 1.0 - (flat_top ? exp2(-shape * log2(t)) : t);
    float value = exp2((flat_top ? 1.5 : shape) * log2(base));
    return t < 1.0 ? value : 0.0;
}

// A patch throws no light behind its own plane, which cuts the receiver in the line
// 1 + edge.d = 0. The part of the kernel beyond it is folded back, mirrored at the line in the
// metric of the conic, which keeps the flux and, where patches end in that line, the evenness of
// their sum. Mirroring adds m = 4 (1 + edge.d) / (edge^T conic^-1 edge) to t: `fold` is edge times
// 4 / (edge^T conic^-1 edge), zero where the line is out of reach. A texel on the line counts by
// its share before it.
float footprint_value(float shape, vec3 conic, vec2 fold, vec2 d) {
    float t = quadratic2(conic, d);
    float value = kernel_value(shape, t);
    if (fold == vec2(0.0)) return value;
    float m = 0.25 * quadratic2(inverse2(conic), fold) + dot(fold, d);
    float share = clamp(0.5 + m / length(fold), 0.0, 1.0);
    return share * (value + kernel_value(shape, t + m));
}
