// Chains as light of a lattice: one central ray with its first-order changes (ray differentials, Igehy 1999).
//
// The including shader declares `push`, and includes chain_ray.glsl, planar_receiver.glsl and kernel.glsl.

#include "perspective.glsl"

// Squared support radius of the sharpest kernel of a curved patch.
const float CHAIN_SUPPORT = 2.0 * (SHARPEST_CURVED + 2.0);

// Columns of Changes that are in use.
int columns() {
    if (DISPERSES) return 5;
    return 4;
}

// The changes of a path in space: of its place and its direction, over the cell (0, 1), over the light (2, 3) and over the
// spectrum (4).
struct Changes {
    vec3 place[5];
    vec3 direction[5];
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
    if (DISPERSES) {
        vec2 place = is_first(path) ? vec2(0.0) : unpackHalf2x16(path.start_or_spectrum.x);
        vec2 direction = is_first(path) ? vec2(0.0) : unpackHalf2x16(path.start_or_spectrum.y);
        changes.place[4] = a * place.x + b * place.y;
        changes.direction[4] = a * direction.x + b * direction.y;
    }
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
    if (DISPERSES && !is_first(path)) {
        vec3 place = changes.place[4], direction = changes.direction[4];
        path.start_or_spectrum.x = packHalf2x16(vec2(dot(a, place), dot(b, place)));
        path.start_or_spectrum.y = packHalf2x16(vec2(dot(a, direction), dot(b, direction)));
    }
}

// The coordinates of the band of the spectrum that a path carries: its first, its extent, and that of the traced light.
vec3 band_of(ChainPath path) {
    uint bands = path.counts >> 28;
    if (bands < 2) return vec3(0.0, 1.0, push.spectral_middle);
    float extent = 1.0 / float(bands);
    float first = float(path.counts >> 24 & 0xfu) * extent;
    return vec3(first, extent, first + 0.5 * extent);
}

// Sets the traced light to that of a path.
void trace_band(ChainPath path) {
    if (DISPERSES) spectral_offset = band_of(path).z - push.spectral_middle;
}

// The part of a path's light on the plane of a receiver.
struct Landing {
    vec2 centre;     // texels of the light-map image
    float distance_; // m
    mat2 of_cell;    // changes over the cell and roots of the light's covariance, texels
    mat2 of_light;
    vec3 band;        // see band_of()
    vec2 of_spectrum; // change over the spectrum, texels
    vec2 slant;       // see set_slant(); 0 where perspective does not show
};

// Maximum number of footprints of a landing, each of a part of its band.
const float MAX_PARTS = 24.0;

// Extent of the band where it lands, in standard deviations of the footprint.
float dispersion_of(Landing landing) {
    if (DISPERSES && landing.of_spectrum != vec2(0.0)) {
        float length2 = dot(landing.of_spectrum, landing.of_spectrum);
        vec2 along = landing.of_spectrum * inversesqrt(length2);
        vec4 deviation = vec4(along * landing.of_cell, along * landing.of_light);
        return landing.band.y * sqrt(length2 / (dot(deviation, deviation) + 1.0 / 12.0));
    }
    return 0.0;
}

// Parts of the band, each no wider than the footprint's standard deviation.
uint parts_of(Landing landing) {
    return uint(clamp(ceil(dispersion_of(landing)), 1.0, MAX_PARTS));
}

// Largest standard deviation of the perspective of a landing.
const float MOST_PERSPECTIVE = 0.5;

// Sets the slant of a landing: slant.d is the linear function of the place that is nearest, over the cell and the light, to the relative
// change of the direction's part across the plane. For light from a point, which may lie behind the surface, it is slant_of() with the
// distance of that point. The slant is 0 where perspective does not show. Light that is spread farther than MOST_PERSPECTIVE, beyond the
// horizon on one side and at the foot of the ray on the other, is narrowed to that.
void set_slant(PlanarReceiver receiver, vec3 r, Changes changes, inout Landing landing) {
    vec2 places[4] = vec2[](landing.of_cell[0], landing.of_cell[1], landing.of_light[0], landing.of_light[1]);
    vec4 relative;
    for (int i = 0; i < 4; i++) relative[i] = dot(changes.direction[i], receiver.normal) / dot(r, receiver.normal);
    relative.xy *= sqrt(push.spread);
    // The inverse of the covariance of places and texel, times the sum of relative[i] places[i], by pairs of columns (Cauchy & Binet), since
    // the terms of a determinant cancel where the landing is a streak.
    float texel = 1.0 / 12.0;
    float determinant = texel * texel;
    vec2 sum = vec2(0.0);
    for (int i = 0; i < 4; i++) {
        determinant += texel * dot(places[i], places[i]);
        sum += texel * relative[i] * places[i];
        for (int k = 0; k < i; k++) {
            float pair = cross2(places[k], places[i]);
            vec2 difference = relative[i] * places[k] - relative[k] * places[i];
            determinant += pair * pair;
            sum += pair * vec2(-difference.y, difference.x);
        }
    }
    vec2 slant = -sum / determinant;
    slant *= LARGEST_SLANT / max(length(slant), LARGEST_SLANT);
    vec4 deviations = vec4(slant * landing.of_cell, slant * landing.of_light);
    float deviation = length(deviations);
    landing.slant = deviation > LEAST_PERSPECTIVE ? slant : vec2(0.0);
    if (deviation > MOST_PERSPECTIVE) {
        vec2 ahead = landing.of_cell * deviations.xy + landing.of_light * deviations.zw;
        ahead *= (1.0 - MOST_PERSPECTIVE / deviation) / (deviation * deviation);
        landing.of_cell -= outerProduct(ahead, deviations.xy);
        landing.of_light -= outerProduct(ahead, deviations.zw);
    }
}

// Returns false where the receiver gets none of it. Light that passes the edge of the rect that the ray meets may land on a receiver
// behind that edge.
bool land(ChainPath path, ChainHit hit, PlanarReceiver receiver, uint index, out Landing landing) {
    vec3 r = path.direction;
    if (!meets_plane(path, receiver, landing.distance_, landing.centre)) return false;
    vec2 low = vec2(receiver.tile_x, receiver.tile_y);
    vec2 high = low + vec2(receiver.width, receiver.height);
    if (landing.distance_ > hit.distance * 1.0001) {
        Object nearer = object_at(triangle_at(hit.triangle).object);
        bool is_other_rect = nearer.kind == DIFFUSE && nearer.shape != MESH && nearer.receiver != int(index);
        if (is_in_tile(receiver, landing.centre) || !is_other_rect) return false;
    }
    Changes changes = changes_of(path);
    float t = landing.distance_;
    for (int i = 0; i < 2; i++) {
        landing.of_cell[i] = landing_change(receiver, r, changes.place[i] + t * changes.direction[i]);
        landing.of_light[i] = landing_change(receiver, r, changes.place[i + 2] + t * changes.direction[i + 2]);
    }
    landing.of_spectrum = DISPERSES ? landing_change(receiver, r, changes.place[4] + t * changes.direction[4]) : vec2(0.0);
    landing.band = band_of(path);
    vec2 first = (landing.band.x - landing.band.z) * landing.of_spectrum;
    vec2 last = first + landing.band.y * landing.of_spectrum;
    landing.of_cell *= sqrt(push.spread);
    set_slant(receiver, r, changes, landing);
    vec3 covariance = covariance_of(landing.of_cell) + covariance_of(landing.of_light) + vec3(1.0, 0.0, 1.0) / 12.0;
    vec4 reach = extent_of(CHAIN_SUPPORT * covariance, -landing.slant);
    return all(lessThan(max(sqrt(CHAIN_SUPPORT * covariance.xz), abs(landing.of_spectrum)), vec2(1e6)))
        && all(greaterThan(landing.centre + max(first, last) + reach.zw, low))
        && all(lessThan(landing.centre + min(first, last) + reach.xy, high));
}
