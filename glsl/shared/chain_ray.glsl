// Chains of mirrors and interfaces: rays from surface to surface. The brighter of the reflected and the refracted lobe is always
// followed, the weaker one by every 4th, 16th ... ray of a lattice only, which then stands for so many.
//
// The including shader declares `normals` and `lights`, and includes trace.glsl, light.glsl, optics.glsl, media.glsl and
// planar_receiver.glsl.

// Maximum number of weak lobes on a chain. Interfaces without a choice, such as total reflection, do not count.
const uint MAX_WEAK = 2;
// A lobe with a smaller share of its cell's flux is not followed.
const float LEAST_SHARE = 0.003;

float largest(vec3 rgb) {
    return max(max(rgb.x, rgb.y), rgb.z);
}

uint interfaces_of(ChainPath path) {
    return path.counts & 0xffu;
}

uint weak_lobes_of(ChainPath path) {
    return path.counts >> 8 & 0x7fu;
}

// In `ChainPath.counts`: the first surface refracted and dispersed the light.
const uint IS_DISPERSED = 1u << 15;

// Whether the light of a path is that of chains where it lands. Light of a single surface is that of facets, unless it is dispersed.
bool is_of_chains(ChainPath path) {
    return interfaces_of(path) > 1 || (path.counts & IS_DISPERSED) != 0;
}

uint lattice_level_of(ChainPath path) {
    return path.counts >> 16 & 0x3u;
}

// How often the sides of the light are halved for the piece of it that the path carries, and the number of the piece.
uint light_halvings_of_path(ChainPath path) {
    return path.counts >> 18 & 0x3u;
}

uint piece_of_path(ChainPath path) {
    return path.counts >> 20 & 0xfu;
}

// Whether a path is a ray of a lattice, which has met no surface.
bool is_first(ChainPath path) {
    return interfaces_of(path) == 0;
}

// The caster that a ray of a lattice is for, and its light.
uint caster_of(ChainPath path) {
    return path.start_or_spectrum.x;
}

uint light_of(ChainPath path) {
    return path.start_or_spectrum.y;
}

// The flux of a path after `distance_`, m, in its medium.
vec3 flux_after(ChainPath path, float distance_) {
    return path.flux * exp(-distance_ * filling(path.media).absorption);
}

// A path at an interface or a mirror, on the side where it arrives.
struct Interaction {
    Object object;
    vec3 geometric;     // unit
    vec3 normal;        // about which light is reflected and refracted, unit
    float side;         // -1 on the back
    float eta;          // index before the surface over that behind; 0: it only reflects
    float eta_change;   // over the spectrum
    uvec2 before;       // media
    uvec2 behind;
    vec3 flux;          // that arrives, W
    vec3 reflectance;
    float traced_reflectance; // of the traced light, which chooses the lobes
};

// Returns false where the path ends: at a diffuse surface, on the back of a mirror, or, as a ray of a lattice, at another caster
// than the lattice's.
bool interact(ChainPath path, ChainHit hit, out Interaction at) {
    if (hit.triangle == NO_TRIANGLE) return false;
    Triangle triangle = triangle_at(hit.triangle);
    at.object = object_at(triangle.object);
    if (at.object.kind == DIFFUSE) return false;
    if (is_first(path) && caster_of(path) != triangle.object) return false;
    at.geometric = normalize(cross(triangle.edge1, triangle.edge2));
    bool front = dot(at.geometric, path.direction) < 0.0;
    if (!front && at.object.kind != DIELECTRIC) return false;
    at.side = front ? 1.0 : -1.0;
    at.geometric *= at.side;
    media_at(hit.media, at.object, front, at.before, at.behind);
    Medium from = filling(at.before);
    Medium to = filling(at.behind);
    at.flux = path.flux;
    bool is_from_sun = is_first(path) && light_at(light_of(path)).is_lamp == 0;
    if (from.absorption != vec3(0.0) && !is_from_sun) at.flux *= exp(-hit.distance * from.absorption);

    Normals corner = normals_at(hit.triangle);
    vec2 w = hit.barycentric;
    vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2) * at.side;
    vec3 s = -path.direction;
    bool is_valid = dot(n, s) > 0.0 && dot(at.geometric, mirrored(s, n)) > 0.0;
    if (is_first(path)) {
        // An element of the surface receives light by its interpolated normal.
        if (!(dot(n, s) > 0.0)) return false;
        at.flux *= dot(n, s) / dot(at.geometric, s);
    } else if (!is_valid) {
        // The interpolated normal would reflect the path into the surface.
        n = at.geometric;
    }
    at.normal = n;
    at.traced_reflectance = 1.0;
    float cosine = dot(n, s);
    at.eta = at.object.kind != DIELECTRIC ? 0.0 : is_sheet(at.object) ? 1.0 : from.ior / to.ior;
    at.eta_change = at.eta == 0.0 || is_sheet(at.object) ? 0.0 : (from.dispersion - at.eta * to.dispersion) / to.ior;
    if (at.object.kind == CONDUCTOR) {
        at.reflectance = fresnel_conductor(cosine, at.object.index / from.ior, at.object.extinction / from.ior);
    } else if (at.object.kind == DIELECTRIC) {
        at.traced_reflectance = is_sheet(at.object) ? sheet_reflectance(at.object, cosine, from.ior) : fresnel_dielectric(cosine, at.eta);
        at.reflectance = vec3(at.traced_reflectance);
        bool has_colours = DISPERSES && spectral_offset == 0.0 && !is_sheet(at.object) && at.traced_reflectance < 1.0;
        if (has_colours) at.reflectance = fresnel_dielectric_of_colours(cosine, from.ior_of_colours / to.ior_of_colours);
    } else {
        at.reflectance = at.object.color;
    }
    return true;
}

// `Lobe.end` of a lobe that is followed, and of one that does not exist.
const uint FOLLOWED = 0xffffffffu;
const uint NO_LOBE = 0xfffffffeu;

// Light that leaves a surface.
struct Lobe {
    bool is_followed;
    uint end;           // where its light ends if it is not followed: an entry of the balance of flux
    vec3 direction;
    vec3 flux;
    bool is_weak;
};

vec3 direction_of(Interaction at, vec3 s, bool refracts) {
    return refracts ? outgoing_direction(s, at.normal, at.eta) : mirrored(s, at.normal);
}

// Whether a direction leads away from the surface, on the side of its lobe.
bool leaves(Interaction at, vec3 direction, bool refracts) {
    return dot(at.geometric, direction) * (refracts ? -1.0 : 1.0) > 0.0;
}

// The reflected (0) and the refracted (1) lobe.
void lobes_of(ChainPath path, Interaction at, out Lobe lobes[2]) {
    vec3 s = -path.direction;
    bool reflects_more = at.traced_reflectance > 0.5;
    bool has_choice = at.eta > 0.0 && at.traced_reflectance < 1.0;
    uint weak = weak_lobes_of(path);
    for (int i = 0; i < 2; i++) {
        Lobe lobe;
        lobe.direction = direction_of(at, s, i == 1);
        lobe.flux = at.flux * (i == 0 ? at.reflectance : 1.0 - at.reflectance);
        bool exists = i == 0 || at.eta > 0.0 && at.traced_reflectance < 1.0;
        lobe.is_weak = has_choice && (i == 0) != reflects_more;
        float share = largest(lobe.flux) / path.first_flux;
        share *= exp2(-2.0 * float(weak));
        if (!exists) lobe.end = NO_LOBE;
        else if (!leaves(at, lobe.direction, i == 1)) lobe.end = FLUX_CUT_NORMALS;
        else if (lobe.is_weak && weak >= MAX_WEAK) lobe.end = FLUX_CUT_WEAK;
        else if (!(share >= LEAST_SHARE)) lobe.end = FLUX_CUT_FAINT;
        else if (lobe.is_weak && lattice_level_of(path) <= weak) lobe.end = FLUX_SAMPLING;
        else lobe.end = FOLLOWED;
        lobe.is_followed = lobe.end == FOLLOWED;
        if (lobe.is_weak) lobe.flux *= 4.0;
        lobes[i] = lobe;
    }
}

// From 0 to 1, independent between rays and between the surfaces of a chain (PCG, Jarzynski & Olano 2020). A low-discrepancy sequence that
// moves on from surface to surface would choose in a fixed relation there, and favour some chains.
float choice(uint index, uint interfaces) {
    uint state = (index ^ interfaces << 24) * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
    return float(((word >> 22) ^ word) >> 8) / float(1u << 24);
}

// One of the two lobes, chosen in proportion to its light by a number from 0 to 1. Returns false where it is not followed.
bool choose_lobe(ChainPath path, Interaction at, float number, out Lobe lobe, out bool refracts) {
    vec3 s = -path.direction;
    refracts = at.eta > 0.0 && number >= at.traced_reflectance;
    lobe.direction = direction_of(at, s, refracts);
    lobe.flux = at.eta > 0.0 ? at.flux : at.flux * at.reflectance;
    if (DISPERSES && at.eta > 0.0) {
        // Colours go this way less or more often than the traced light.
        lobe.flux *= refracts ? (1.0 - at.reflectance) / (1.0 - at.traced_reflectance) : at.reflectance / at.traced_reflectance;
    }
    lobe.is_weak = false;
    if (!leaves(at, lobe.direction, refracts)) lobe.end = FLUX_CUT_NORMALS;
    else if (!(largest(lobe.flux) * exp2(-2.0 * float(weak_lobes_of(path))) >= LEAST_SHARE * path.first_flux)) lobe.end = FLUX_CUT_FAINT;
    else lobe.end = FOLLOWED;
    lobe.is_followed = lobe.end == FOLLOWED;
    return lobe.is_followed;
}

// The ray that leaves the surface, without its changes.
ChainPath next_ray(ChainPath path, ChainHit hit, Interaction at, Lobe lobe, bool refracts) {
    ChainPath next;
    next.position = path.position + hit.distance * path.direction;
    next.triangle = hit.triangle;
    next.direction = lobe.direction;
    next.first_flux = path.first_flux;
    if (is_first(path)) next.first_flux *= largest(at.flux) / largest(path.flux);
    next.flux = lobe.flux;
    next.counts = path.counts + 1;
    if (DISPERSES && refracts && is_first(path) && is_dispersing(at.object, light_at(light_of(path)))) next.counts |= IS_DISPERSED;
    next.media = refracts ? at.behind : at.before;
    next.start_or_spectrum = uvec2(0);
    return next;
}

// Where a ray meets the front of a receiver's plane. Returns false where it does not.
bool meets_plane(ChainPath path, PlanarReceiver receiver, out float distance_, out vec2 place) {
    float along = dot(path.direction, receiver.normal);
    float away = dot(receiver.origin - path.position, receiver.normal);
    if (!(along < 0.0 && away < 0.0)) return false;
    distance_ = away / along;
    place = to_texels(receiver, path.position + distance_ * path.direction);
    return true;
}

// The same within the receiver's rectangle and before the path's hit.
bool lands_on(ChainPath path, ChainHit hit, PlanarReceiver receiver, out float distance_, out vec2 place) {
    return meets_plane(path, receiver, distance_, place) && distance_ <= hit.distance * 1.0001 && is_in_tile(receiver, place);
}
