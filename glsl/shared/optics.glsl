// Reflection, refraction, their derivatives, and Fresnel's equations. src/optics.rs cites the sources. `eta` is the
// index of refraction on the side of the light over that on the other side; 0 stands for reflection.

// Whether a medium disperses light.
layout(constant_id = ID_DISPERSES) const bool DISPERSES = false;
// Place of the traced light on the spectrum, beyond the middle (spectrum.glsl); 0: light of all wavelengths.
float spectral_offset = 0.0;

// Whether no surface of the scene refracts. The compiler then removes the equations of refraction.
layout(constant_id = ID_ONLY_MIRRORS) const bool ONLY_MIRRORS = false;

// Direction of the light that a surface with the unit normal n reflects when light comes from s (unit, away from the
// surface): 2 (n.s) n - s. GLSL's reflect() takes the direction of travel, -s.
vec3 mirrored(vec3 s, vec3 n) {
    return 2.0 * dot(n, s) * n - s;
}

// Change of mirrored(s, n) with the normal (by dn) and with s (by ds).
vec3 mirrored_change(vec3 s, vec3 n, vec3 ds, vec3 dn) {
    return 2.0 * (dot(dn, s) + dot(n, ds)) * n + 2.0 * dot(n, s) * dn - ds;
}

// Reflectance of the interface between two dielectrics for unpolarised light.
float fresnel_dielectric(float cosine, float eta) {
    float square = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if (square <= 0.0) return 1.0;
    float cos_t = sqrt(square);
    float r_s = (eta * cosine - cos_t) / (eta * cosine + cos_t);
    float r_p = (cosine - eta * cos_t) / (cosine + eta * cos_t);
    return 0.5 * (r_s * r_s + r_p * r_p);
}

// The same for light of all wavelengths, with the ratio of indices of each colour channel's mean wavelength.
vec3 fresnel_dielectric_of_colours(float cosine, vec3 eta) {
    return vec3(fresnel_dielectric(cosine, eta.r), fresnel_dielectric(cosine, eta.g), fresnel_dielectric(cosine, eta.b));
}

// A sheet is a pair of interfaces at one place: light passes it as if there were none, less what is reflected.
bool is_sheet(Object object) {
    return object.shape == SHEET;
}

// A closed body without a receiver in it: light that enters it lands nowhere before it meets another surface.
bool is_solid(Object object) {
    return object.shape == SOLID;
}

// Whether chains draw the light of a sun or lamp that the object refracts, since it is dispersed.
bool is_dispersing(Object object, Light light) {
    return DISPERSES && object.shape == DISPERSING && light.half_azimuth == 0.0;
}

// Reflectance of a sheet in a medium of the index `around`: light goes to and fro between its interfaces.
float sheet_reflectance(Object object, float cosine, float around) {
    float once = fresnel_dielectric(cosine, around / object.index.x);
    return 2.0 * once / (1.0 + once);
}

// Index of refraction on the side of the light over that on the other side, for light on the front or on the back; 0
// for a surface that only reflects.
float eta_of(Object object, bool front) {
    if (ONLY_MIRRORS || object.kind != DIELECTRIC) return 0.0;
    if (is_sheet(object)) return 1.0;
    return front ? 1.0 / object.index.x : object.index.x;
}

// Direction of the light that leaves a surface when light comes from s; n is the unit normal on the side of s. eta = 0:
// reflected; otherwise refracted. Zero on total reflection.
vec3 outgoing_direction(vec3 s, vec3 n, float eta) {
    if (eta == 0.0) return mirrored(s, n);
    return dot(n, s) > 0.0 ? refract(-s, n, eta) : vec3(0.0);
}

// Change of outgoing_direction(s, n, eta), where it is not zero, with the normal (by dn) and with s (by ds).
vec3 outgoing_change(vec3 s, vec3 n, vec3 ds, vec3 dn, float eta) {
    if (eta == 0.0) return mirrored_change(s, n, ds, dn);
    float cosine = dot(n, s);
    float change = dot(dn, s) + dot(n, ds);
    float cos_t = sqrt(max(1.0 - eta * eta * (1.0 - cosine * cosine), 1e-12));
    float cos_t_change = eta * eta * cosine * change / cos_t;
    return -eta * ds + (eta * change - cos_t_change) * n + (eta * cosine - cos_t) * dn;
}

// Change of outgoing_direction(s, n, eta), where light is refracted, with eta.
vec3 outgoing_change_with_eta(vec3 s, vec3 n, float eta) {
    float cosine = dot(n, s);
    float sine2 = 1.0 - cosine * cosine;
    float cos_t = sqrt(max(1.0 - eta * eta * sine2, 1e-12));
    return (cosine + eta * sine2 / cos_t) * n - s;
}

// Refracted light that travels along q, at the angle of cosine `cosine` to the normal, came from the direction
// normal_coefficient() n - q / eta (Snell's law in vector form). 0 for eta = 1, where there is no interface.
float normal_coefficient(float cosine, float eta) {
    float cos_i = sqrt(max(1.0 - (1.0 - cosine * cosine) / (eta * eta), 0.0));
    return cos_i - cosine / eta;
}

// Reflectance of a metal for unpolarised light.
vec3 fresnel_conductor(float cosine, vec3 index, vec3 extinction) {
    float cosine2 = cosine * cosine;
    float sine2 = 1.0 - cosine2;
    vec3 index2 = index * index;
    vec3 extinction2 = extinction * extinction;
    vec3 real = index2 - extinction2 - sine2;
    vec3 modulus = sqrt(real * real + 4.0 * index2 * extinction2);
    vec3 a = sqrt(max(0.5 * (modulus + real), 0.0));
    vec3 reflectance_s = (modulus + cosine2 - 2.0 * a * cosine) / (modulus + cosine2 + 2.0 * a * cosine);
    vec3 even = modulus * cosine2 + sine2 * sine2;
    vec3 odd = 2.0 * a * cosine * sine2;
    return 0.5 * reflectance_s * (1.0 + (even - odd) / (even + odd));
}

// Reflectance of a specular surface in air. Dielectrics use `eta`.
vec3 reflected_share(Object object, float cosine, float eta) {
    switch (object.kind) {
    case CONDUCTOR: return fresnel_conductor(cosine, object.index, object.extinction);
    case DIELECTRIC:
        if (is_sheet(object)) return vec3(sheet_reflectance(object, cosine, 1.0));
        if (DISPERSES && spectral_offset == 0.0) {
            bool front = abs(eta * object.index.x - 1.0) < 1e-5;
            return fresnel_dielectric_of_colours(cosine, front ? 1.0 / object.color : object.color);
        }
        return vec3(fresnel_dielectric(cosine, eta));
    default: return object.color;
    }
}

// Change of normalize(v) when v changes by dv.
vec3 normalize_change(vec3 v, vec3 dv) {
    vec3 unit = normalize(v);
    return (dv - unit * dot(unit, dv)) / length(v);
}

// Two unit vectors that complete the unit vector n to a right-handed orthonormal basis (Duff et al. 2017).
void basis(vec3 n, out vec3 a, out vec3 b) {
    float sign = n.z >= 0.0 ? 1.0 : -1.0;
    float c = -1.0 / (sign + n.z);
    float d = n.x * n.y * c;
    a = vec3(1.0 + sign * n.x * n.x * c, sign * d, -sign * n.x);
    b = vec3(d, sign + n.y * n.y * c, -n.y);
}
