// Reflection and its derivative.

// Direction that leaves a mirror of unit normal n when light comes from s (unit, away from the
// mirror): 2 (n.s) n - s. GLSL's reflect() takes the direction of travel, -s.
vec3 mirrored(vec3 s, vec3 n) {
    return 2.0 * dot(n, s) * n - s;
}

// Change of mirrored(s, n) with the normal (dn) and with s (ds).
vec3 mirrored_change(vec3 s, vec3 n, vec3 ds, vec3 dn) {
    return 2.0 * (dot(dn, s) + dot(n, ds)) * n + 2.0 * dot(n, s) * dn - ds;
}

// Change of normalize(v) when v changes by dv.
vec3 normalize_change(vec3 v, vec3 dv) {
    vec3 unit = normalize(v);
    return (dv - unit * dot(unit, dv)) / length(v);
}

// Two unit vectors that complete the unit vector n to a right-handed basis (Duff et al. 2017).
void basis(vec3 n, out vec3 a, out vec3 b) {
    float sign = n.z >= 0.0 ? 1.0 : -1.0;
    float c = -1.0 / (sign + n.z);
    float d = n.x * n.y * c;
    a = vec3(1.0 + sign * n.x * n.x * c, sign * d, -sign * n.x);
    b = vec3(d, sign + n.y * n.y * c, -n.y);
}
