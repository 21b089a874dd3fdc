// Reflection, refraction, their derivatives, and Fresnel's equations. src/optics.rs has the sources.

// Whether the scene has no surfaces that let light through. Then their equations are left out.
layout(constant_id = 0) const bool ONLY_MIRRORS = false;

// Direction that leaves a mirror of unit normal n when light comes from s (unit, away from the
// mirror): 2 (n.s) n - s. GLSL's reflect() takes the direction of travel, -s.
vec3 mirrored(vec3 s, vec3 n) {
    return 2.0 * dot(n, s) * n - s;
}

// Change of mirrored(s, n) with the normal (dn) and with s (ds).
vec3 mirrored_change(vec3 s, vec3 n, vec3 ds, vec3 dn) {
    return 2.0 * (dot(dn, s) + dot(n, ds)) * n + 2.0 * dot(n, s) * dn - ds;
}

// Index of refraction on the side of the light over that beyond, for light on the front or behind;
// 0 for a surface that only reflects.
float eta_of(Object object, bool front) {
    if (ONLY_MIRRORS || object.kind != DIELECTRIC) return 0.0;
    return front ? 1.0 / object.index.x : object.index.x;
}

// Direction that light from s takes at a surface with the unit normal n on its side: mirrored for
// ratio 0, otherwise refracted, `ratio` the index of refraction on the side of s over that beyond.
// Zero where all light is reflected.
vec3 outgoing_direction(vec3 s, vec3 n, float eta) {
    if (eta == 0.0) return mirrored(s, n);
    return dot(n, s) > 0.0 ? refract(-s, n, eta) : vec3(0.0);
}

// Change of sent(s, n, ratio), where there is any, with the normal (dn) and with s (ds).
vec3 outgoing_change(vec3 s, vec3 n, vec3 ds, vec3 dn, float eta) {
    if (eta == 0.0) return mirrored_change(s, n, ds, dn);
    float cosine = dot(n, s);
    float change = dot(dn, s) + dot(n, ds);
    float beyond = sqrt(max(1.0 - eta * eta * (1.0 - cosine * cosine), 1e-12));
    float beyond_change = eta * eta * cosine * change / beyond;
    return -eta * ds + (eta * change - beyond_change) * n + (eta * cosine - beyond) * dn;
}

// Light that goes on along q, at `cosine` to the normal, came from the direction
// bend_at() n - q / ratio, `ratio` the index of refraction before the surface over that beyond. 0 where there is no surface:
// ratio 1.
float normal_coefficient(float cosine, float eta) {
    float before = sqrt(max(1.0 - (1.0 - cosine * cosine) / (eta * eta), 0.0));
    return before - cosine / eta;
}

// Share of unpolarised light that a surface between two transparent media reflects.
float fresnel_dielectric(float cosine, float eta) {
    float square = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if (square <= 0.0) return 1.0;
    float beyond = sqrt(square);
    float across = (eta * cosine - beyond) / (eta * cosine + beyond);
    float along = (cosine - eta * beyond) / (cosine + eta * beyond);
    return 0.5 * (across * across + along * along);
}

// Share that a metal reflects.
vec3 fresnel_conductor(float cosine, vec3 index, vec3 extinction) {
    float cosine2 = cosine * cosine;
    float sine2 = 1.0 - cosine2;
    vec3 index2 = index * index;
    vec3 extinction2 = extinction * extinction;
    vec3 real = index2 - extinction2 - sine2;
    vec3 modulus = sqrt(real * real + 4.0 * index2 * extinction2);
    vec3 a = sqrt(max(0.5 * (modulus + real), 0.0));
    vec3 across = (modulus + cosine2 - 2.0 * a * cosine) / (modulus + cosine2 + 2.0 * a * cosine);
    vec3 even = modulus * cosine2 + sine2 * sine2;
    vec3 odd = 2.0 * a * cosine * sine2;
    return 0.5 * across * (1.0 + (even - odd) / (even + odd));
}

// Share of the light that a specular surface reflects; `ratio` as above, for a dielectric.
vec3 reflected_share(Object object, float cosine, float eta) {
    switch (object.kind) {
    case CONDUCTOR: return fresnel_conductor(cosine, object.index, object.extinction);
    case DIELECTRIC: return vec3(fresnel_dielectric(cosine, eta));
    default: return object.color;
    }
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
