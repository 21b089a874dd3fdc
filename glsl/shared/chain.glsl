// Chains of mirrors and interfaces: one central ray of a lattice with its first-order changes (ray differentials, Igehy 1999),
// followed from surface to surface. The brighter of the reflected and the refracted lobe is always followed, the weaker one by
// every 4th, 16th ... ray of the lattice only, which then stands for so many.
//
// The including shader declares the buffers that trace.glsl needs, `normals`, `lights`, `planar_receivers`, `lattices` and
// `push`, and includes trace.glsl, light.glsl, optics.glsl, media.glsl, flux.glsl and planar_receiver.glsl.

// Maximum number of weak lobes on a chain. Interfaces without a choice, such as total reflection, do not count.
const uint MAX_WEAK = 2;
// A lobe with a smaller share of its cell's flux is not followed.
const float LEAST_SHARE = 0.003;
// Coarsest sub-lattice: every 4^MAX_LEVEL_OF_LATTICE-th ray.
const uint MAX_LATTICE_LEVEL = 3;
// Squared support radius of the sharpest kernel of a curved patch, p = SHARPEST_CURVED: 2 (p + 2).
const float CHAIN_SUPPORT = 12.0;

float largest(vec3 rgb) {
    return max(max(rgb.x, rgb.y), rgb.z);
}

uint interfaces_of(ChainPath path) {
    return path.counts & 0xffu;
}

uint weak_lobes_of(ChainPath path) {
    return path.counts >> 8 & 0xffu;
}

uint lattice_level_of(ChainPath path) {
    return path.counts >> 16;
}

// The changes of a path in space: of its place and its direction, over the cell (0, 1) and over the light (2, 3).
struct Changes {
    vec3 place[4];
    vec3 direction[4];
};

Changes changes_of(ChainPath path) {
    vec3 a, b;
    basis(path.direction, a, b);
    Changes changes;
    changes.place[0] = a * path.cell_place.x + b * path.cell_place.y;
    changes.place[1] = a * path.cell_place.z + b * path.cell_place.w;
    changes.place[2] = a * path.light_place.x + b * path.light_place.y;
    changes.place[3] = a * path.light_place.z + b * path.light_place.w;
    changes.direction[0] = a * path.cell_direction.x + b * path.cell_direction.y;
    changes.direction[1] = a * path.cell_direction.z + b * path.cell_direction.w;
    changes.direction[2] = a * path.light_direction.x + b * path.light_direction.y;
    changes.direction[3] = a * path.light_direction.z + b * path.light_direction.w;
    return changes;
}

vec4 across(vec3 a, vec3 b, vec3 first, vec3 second) {
    return vec4(dot(a, first), dot(b, first), dot(a, second), dot(b, second));
}

void set_changes(inout ChainPath path, Changes changes) {
    vec3 a, b;
    basis(path.direction, a, b);
    path.cell_place = across(a, b, changes.place[0], changes.place[1]);
    path.light_place = across(a, b, changes.place[2], changes.place[3]);
    path.cell_direction = across(a, b, changes.direction[0], changes.direction[1]);
    path.light_direction = across(a, b, changes.direction[2], changes.direction[3]);
}

#define FIRST_RAY(i) lattices[i].first

// The lattice of ray number `ray`.
ChainLattice lattice_of(uint ray) {
    SEARCH(found, 0, push.lattice_count, ray, FIRST_RAY)
    return lattices[found];
}

// Ray number `ray` as it leaves its light.
ChainPath ray_of_lattice(ChainLattice lattice, uint ray) {
    Light light = light_at(lattice.light);
    uvec2 place = uvec2((ray - lattice.first) % lattice.columns, (ray - lattice.first) / lattice.columns);
    vec3 at = lattice.origin + (float(place.x) + 0.5) * lattice.edge_u + (float(place.y) + 0.5) * lattice.edge_v;
    uint level = min(uint(min(findLSB(place.x | 1u << MAX_LATTICE_LEVEL), findLSB(place.y | 1u << MAX_LATTICE_LEVEL))), MAX_LATTICE_LEVEL);
    ChainPath path;
    path.triangle = NO_TRIANGLE;
    path.counts = level << 16;
    path.media = path.unused = uvec2(0);
    float area = length(cross(lattice.edge_u, lattice.edge_v));
    Changes changes;
    changes.place[2] = changes.place[3] = changes.direction[2] = changes.direction[3] = vec3(0.0);
    if (light.is_lamp == 0) {
        path.position = at;
        path.direction = lattice.direction;
        path.flux = light.power * area;
        changes.place[0] = lattice.edge_u;
        changes.place[1] = lattice.edge_v;
        changes.direction[0] = changes.direction[1] = vec3(0.0);
    } else {
        vec3 way = at - light.place;
        float distance_ = length(way);
        path.position = light.place;
        path.direction = way / distance_;
        // The solid angle of the cell.
        float cosine = abs(dot(path.direction, cross(lattice.edge_u, lattice.edge_v))) / area;
        path.flux = light.power * (area * cosine / (distance_ * distance_));
        changes.place[0] = changes.place[1] = vec3(0.0);
        changes.direction[0] = normalize_change(way, lattice.edge_u);
        changes.direction[1] = normalize_change(way, lattice.edge_v);
    }
    path.first_flux = largest(path.flux);
    set_changes(path, changes);
    return path;
}

// A path at an interface or a mirror, on the side where it arrives.
struct Interaction {
    Object object;
    vec3 geometric;     // unit
    vec3 normal;        // about which light is reflected and refracted, unit
    float side;         // -1 on the back
    float eta;          // index before the surface over that behind; 0: it only reflects
    uvec2 before;       // media
    uvec2 behind;
    vec3 flux;          // that arrives, W
    vec3 reflectance;
};

// Returns false where the path ends: at a diffuse surface, on the back of a mirror, or, as a ray of `lattice`, at another caster
// than the lattice's.
bool interact(ChainPath path, ChainHit hit, ChainLattice lattice, bool is_first, out Interaction at) {
    if (hit.triangle == NO_TRIANGLE) return false;
    Triangle triangle = triangle_at(hit.triangle);
    at.object = object_at(triangle.object);
    if (at.object.kind == DIFFUSE) return false;
    if (is_first && lattice.object != triangle.object) return false;
    at.geometric = normalize(cross(triangle.edge1, triangle.edge2));
    bool front = dot(at.geometric, path.direction) < 0.0;
    if (!front && at.object.kind != DIELECTRIC) return false;
    at.side = front ? 1.0 : -1.0;
    at.geometric *= at.side;
    media_at(hit.media, at.object, front, at.before, at.behind);
    Medium from = filling(at.before);
    Medium to = filling(at.behind);
    at.flux = path.flux;
    bool is_from_sun = is_first && light_at(lattice.light).is_lamp == 0;
    if (from.absorption != vec3(0.0) && !is_from_sun) at.flux *= exp(-hit.distance * from.absorption);

    Normals corner = normals_at(hit.triangle);
    vec2 w = hit.barycentric;
    vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2) * at.side;
    vec3 s = -path.direction;
    bool is_valid = dot(n, s) > 0.0 && dot(at.geometric, mirrored(s, n)) > 0.0;
    if (is_first) {
        // An element of the surface receives light by its interpolated normal.
        if (!(dot(n, s) > 0.0)) return false;
        at.flux *= dot(n, s) / dot(at.geometric, s);
    } else if (!is_valid) {
        // The interpolated normal would reflect the path into the surface.
        n = at.geometric;
    }
    at.normal = n;
    float cosine = dot(n, s);
    at.eta = at.object.kind != DIELECTRIC ? 0.0 : is_sheet(at.object) ? 1.0 : from.ior / to.ior;
    if (at.object.kind == CONDUCTOR) {
        at.reflectance = fresnel_conductor(cosine, at.object.index / from.ior, at.object.extinction / from.ior);
    } else if (at.object.kind == DIELECTRIC) {
        at.reflectance = vec3(is_sheet(at.object) ? sheet_reflectance(at.object, cosine, from.ior) : fresnel_dielectric(cosine, at.eta));
    } else {
        at.reflectance = at.object.color;
    }
    return true;
}

// Light that leaves a surface.
struct Lobe {
    bool is_followed;
    vec3 direction;
    vec3 flux;
    bool is_weak;
};

// The reflected (0) and the refracted (1) lobe.
void lobes_of(ChainPath path, Interaction at, out Lobe lobes[2]) {
    vec3 s = -path.direction;
    bool reflects_more = at.reflectance.x > 0.5;
    bool has_choice = at.eta > 0.0 && at.reflectance.x < 1.0;
    uint weak = weak_lobes_of(path);
    for (int i = 0; i < 2; i++) {
        Lobe lobe;
        lobe.direction = i == 0 ? mirrored(s, at.normal) : outgoing_direction(s, at.normal, at.eta);
        lobe.flux = at.flux * (i == 0 ? at.reflectance : 1.0 - at.reflectance);
        bool exists = i == 0 || at.eta > 0.0 && at.reflectance.x < 1.0;
        float ahead = dot(at.geometric, lobe.direction) * (i == 0 ? 1.0 : -1.0);
        lobe.is_weak = has_choice && (i == 0) != reflects_more;
        lobe.is_followed = exists && ahead > 0.0;
        float share = largest(lobe.flux) / path.first_flux;
        share *= exp2(-2.0 * float(weak));
        if (lobe.is_weak) {
            lobe.is_followed = lobe.is_followed && weak < MAX_WEAK && lattice_level_of(path) > weak;
            lobe.flux *= 4.0;
        }
        lobe.is_followed = lobe.is_followed && share >= LEAST_SHARE;
        lobes[i] = lobe;
    }
}

// The ray that leaves the surface, but for its changes.
ChainPath next_ray(ChainPath path, ChainHit hit, Interaction at, Lobe lobe, bool refracts, bool is_first) {
    ChainPath next;
    next.position = path.position + hit.distance * path.direction;
    next.triangle = hit.triangle;
    next.direction = lobe.direction;
    next.first_flux = path.first_flux;
    if (is_first) next.first_flux *= largest(at.flux) / largest(path.flux);
    next.flux = lobe.flux;
    next.counts = path.counts + 1;
    next.media = refracts ? at.behind : at.before;
    next.unused = uvec2(0);
    return next;
}

// The part of a path's light on the plane of a receiver.
struct Landing {
    vec2 centre;     // texels of the light-map image
    float distance_; // m
    mat2 of_cell;    // changes over the cell and roots of the light's covariance, texels
    mat2 of_light;
};

// Where a ray meets the front of a receiver's plane. Returns false where it does not.
bool meets_plane(ChainPath path, PlanarReceiver receiver, out float distance_, out vec2 place) {
    float along = dot(path.direction, receiver.normal);
    float away = dot(receiver.origin - path.position, receiver.normal);
    if (!(along < 0.0 && away < 0.0)) return false;
    distance_ = away / along;
    place = to_texels(receiver, path.position + distance_ * path.direction);
    return true;
}

// Returns false where the receiver gets none of it. Light that passes the edge of the receiver that the ray meets may land on
// another receiver behind that edge.
bool land(ChainPath path, ChainHit hit, PlanarReceiver receiver, uint index, out Landing landing) {
    vec3 r = path.direction;
    if (!meets_plane(path, receiver, landing.distance_, landing.centre)) return false;
    vec2 low = vec2(receiver.tile_x, receiver.tile_y);
    vec2 high = low + vec2(receiver.width, receiver.height);
    if (landing.distance_ > hit.distance * 1.0001) {
        Object nearer = object_at(triangle_at(hit.triangle).object);
        bool is_inside = all(greaterThanEqual(landing.centre, low)) && all(lessThan(landing.centre, high));
        bool is_receiver = nearer.kind == DIFFUSE && nearer.receiver >= 0 && nearer.is_mesh == 0;
        if (is_inside || !is_receiver || nearer.receiver == int(index)) return false;
    }
    Changes changes = changes_of(path);
    float t = landing.distance_;
    for (int i = 0; i < 2; i++) {
        landing.of_cell[i] = landing_change(receiver, r, changes.place[i] + t * changes.direction[i]);
        landing.of_light[i] = landing_change(receiver, r, changes.place[i + 2] + t * changes.direction[i + 2]);
    }
    landing.of_cell *= sqrt(push.spread);
    vec2 variance = landing.of_cell[0] * landing.of_cell[0] + landing.of_cell[1] * landing.of_cell[1]
        + landing.of_light[0] * landing.of_light[0] + landing.of_light[1] * landing.of_light[1] + 1.0 / 12.0;
    vec2 reach = sqrt(CHAIN_SUPPORT * variance);
    return all(lessThan(reach, vec2(1e6))) && all(greaterThan(landing.centre + reach, low)) && all(lessThan(landing.centre - reach, high));
}
