// The image of a cell of a surface on a planar receiver: where its corners and the midpoints of its sides land, and how
// the light's disc and the texel blur it. The including shader includes facet.glsl and kernel.glsl.

#include "light_axes.glsl"
#include "perspective.glsl"

struct CellImage {
    vec2 corners[3];   // texels
    vec2 midpoints[3]; // of the sides 01, 12 and 20
    vec3 margins;      // of the corners: see Landing
    vec3 flux;         // W
    vec3 density;      // cosine times the share of the light at the corners
    mat2 of_light;     // root of the covariance of the light's disc, texels
    vec3 blur;         // covariance of that disc and a texel, texels^2
    float blur_determinant; // of that covariance, texels^4
    vec2 slant;        // at midpoint 12, see slant_of(); 0 where perspective does not show
    bool is_lit;       // whether some of them do, and all corners send light
};

// The rays that leave a cell.
struct CellRays {
    OutgoingRay corners[3];
    OutgoingRay midpoints[3]; // of the sides 01, 12 and 20
    // Changes of the direction at midpoint 12 along the axes of the part of the light's disc that lights it: see light_axes().
    vec3 change1;
    vec3 change2;
};

CellRays rays_of(Surface surface, Cell cell, Light light, float eta) {
    CellRays rays;
    for (int i = 0; i < 3; i++) {
        rays.corners[i] = leave(surface, light, eta, place_in(cell, vec2(i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0)));
        rays.midpoints[i] = leave(surface, light, eta, place_in(cell, vec2(i == 2 ? 0.0 : 0.5, i == 0 ? 0.0 : 0.5)));
    }
    vec3 n = normal_at(surface, place_in(cell, vec2(0.5)));
    LightDisc disc = disc_at(light, rays.midpoints[1].position);
    DiscPart part = lit_part(surface, light, disc, n, eta);
    light_axes(light, disc, rays.change1, rays.change2);
    rays.change1 = outgoing_change(part.direction, n, narrowed(part, rays.change1), vec3(0.0), eta);
    rays.change2 = outgoing_change(part.direction, n, narrowed(part, rays.change2), vec3(0.0), eta);
    return rays;
}

// Largest perspective of the whole image over that of the disc with which the disc's perspective counts: the corners of a longer image
// have perspective themselves.
const float LARGEST_IMAGE = 2.0;

// Whether perspective shapes the image of the disc: where light nearly grazes the plane, the far side is longer.
bool has_perspective(CellImage image) {
    float deviation = length(image.slant * image.of_light);
    float longest = 0.0;
    for (int i = 0; i < 3; i++) longest = max(longest, abs(dot(image.slant, image.corners[i] - image.midpoints[1])));
    return deviation > LEAST_PERSPECTIVE && longest < min(LARGEST_IMAGE * deviation, 0.5) && length(image.slant) < LARGEST_SLANT;
}

// Sets the blur from the light's disc.
void set_blur(inout CellImage image) {
    const float of_texel = 1.0 / 12.0;
    image.blur = covariance_of(image.of_light) + of_texel * vec3(1.0, 0.0, 1.0);
    image.blur_determinant = determinant_of(image.of_light, of_texel);
}

CellImage image_of(Surface surface, Cell cell, CellRays rays, Light light, PlanarReceiver receiver) {
    CellImage image;
    bool some = false;
    // Whether all of these points send light to the receiver's front.
    bool is_whole = true;
    bool all_send = true;
    vec3 at_corners = vec3(0.0);
    vec3 at_midpoints = vec3(0.0);
    for (int i = 0; i < 3; i++) {
        OutgoingRay ray = rays.corners[i];
        Landing landing = land(surface, ray, receiver);
        bool lands = landing.margin >= 0.0;
        vec3 irradiance_factor = lands ? landing.part.share * ray.irradiance_factor : vec3(0.0);
        image.corners[i] = landing.texel;
        image.margins[i] = landing.margin;
        image.density[i] = dot(irradiance_factor, vec3(1.0));
        all_send = all_send && ray.direction != vec3(0.0);
        at_corners += irradiance_factor;
        OutgoingRay middle = rays.midpoints[i];
        Landing middle_landing = land(surface, middle, receiver);
        bool middle_lands = middle_landing.margin >= 0.0;
        image.midpoints[i] = middle_landing.texel;
        at_midpoints += middle_lands ? middle_landing.part.share * middle.irradiance_factor : vec3(0.0);
        is_whole = is_whole && lands && middle_lands;
        some = some || lands || middle_lands;
        if (i == 1) {
            DiscPart part = middle_landing.part;
            image.of_light = mat2(landing_change(receiver, part.direction, middle_landing.distance_ * narrowed(part, rays.change1)),
                landing_change(receiver, part.direction, middle_landing.distance_ * narrowed(part, rays.change2)));
            image.slant = slant_of(receiver, part.direction, middle_landing.distance_);
        }
    }
    if (BEAMS) image.of_light = mat2(0.0);
    if (!has_perspective(image)) image.slant = vec2(0.0);
    set_blur(image);
    // The mean over the midpoints is exact for quadratic functions. Where only a part of the cell sends light, the
    // corners count too.
    vec3 mean = is_whole ? at_midpoints / 3.0 : at_midpoints / 4.0 + at_corners / 12.0;
    image.flux = light.power * mean * (0.5 * length(cross(surface.edge1, surface.edge2)) * abs(determinant(cell.sides)));
    image.is_lit = some && all_send;
    return image;
}

// The largest distance of a midpoint from the straight side, texels.
float deviation_of(CellImage image) {
    float most = 0.0;
    for (int i = 0; i < 3; i++) most = max(most, distance(image.midpoints[i], 0.5 * (image.corners[i] + image.corners[(i + 1) % 3])));
    return most;
}

float longest_side(CellImage image) {
    return max(max(distance(image.corners[0], image.corners[1]), distance(image.corners[1], image.corners[2])), distance(image.corners[2], image.corners[0]));
}

// Twice the signed area of the triangle between the corners, texels^2.
float doubled_area(CellImage image) {
    return cross2(image.corners[1] - image.corners[0], image.corners[2] - image.corners[0]);
}

// Height over the longest side, texels.
float height_of(CellImage image) {
    return abs(doubled_area(image)) / max(longest_side(image), 1e-6);
}

// Smallest ratio of the image's area element at a corner to the triangle's, below which a fold is near.
const float MIN_STRETCH = 0.25;

// Area elements of the quadratic map through the six places, at the three corners.
vec3 area_elements(CellImage image) {
    vec3 elements;
    for (int k = 0; k < 3; k++) {
        // Derivatives at corner k along the sides to the next and the last corner.
        vec2 next = 4.0 * image.midpoints[k] - 3.0 * image.corners[k] - image.corners[(k + 1) % 3];
        vec2 last = 4.0 * image.midpoints[(k + 2) % 3] - 3.0 * image.corners[k] - image.corners[(k + 2) % 3];
        elements[k] = cross2(next, last);
    }
    return elements;
}

// Whether a fold of the image is within the triangle or near it.
bool near_fold(CellImage image, vec3 elements) {
    float area = doubled_area(image);
    return any(lessThanEqual(elements * area, vec3(MIN_STRETCH * area * area)));
}

// Side of a square as large as the parallelogram that blurs the image, texels.
float blur_side(CellImage image) {
    return sqrt(box_area(image.blur_determinant));
}

// Whether no part of the image falls on the receiver's light map.
bool misses(CellImage image, PlanarReceiver receiver) {
    vec2 centre = image.midpoints[1];
    vec2 low = vec2(1e9);
    vec2 high = vec2(-1e9);
    for (int i = 0; i < 3; i++) {
        vec2 corner = without_perspective(image.slant, image.corners[i] - centre);
        low = min(low, corner);
        high = max(high, corner);
    }
    mat2 box = blur_box(image.blur, image.blur_determinant);
    vec2 beyond = deviation_of(image) + 0.5 * (abs(box[0]) + abs(box[1]));
    low -= beyond;
    high += beyond;
    vec2 tile_low = vec2(receiver.tile_x, receiver.tile_y) - centre;
    vec2 tile_high = tile_low + vec2(receiver.width, receiver.height);
    if (image.slant != vec2(0.0)) add_perspective(image.slant, vec4(tile_low, tile_high), low, high);
    return any(lessThan(high, tile_low)) || any(greaterThan(low, tile_high));
}

// --- Clipping -------------------------------------------------------------------------------------------------------

// Number of triangles that remain of a cell where margins are positive; `margins` are those of its corners.
uint clipped_parts(vec3 margins) {
    uint positive = (margins.x >= 0.0 ? 1 : 0) + (margins.y >= 0.0 ? 1 : 0) + (margins.z >= 0.0 ? 1 : 0);
    return positive == 2 ? 2 : 1;
}

Cell cell_between(vec2 a, vec2 b, vec2 c) {
    return Cell(a, mat2(b - a, c - a));
}

// The last point between `inside` and `outside` that sends light to the receiver's front, if `is_clipped`. lavapipe runs
// the code of a branch that no thread takes, but only one iteration of such a loop.
vec2 edge_between(Surface surface, Light light, PlanarReceiver receiver, float eta, vec2 inside, vec2 outside, bool is_clipped) {
    for (int i = 0; i < (is_clipped ? 6 : 0); i++) {
        vec2 middle = 0.5 * (inside + outside);
        if (land(surface, leave(surface, light, eta, middle), receiver).margin >= 0.0) inside = middle; else outside = middle;
    }
    return inside;
}

// Part `part` of the cell that sends light to the receiver's front, if `is_clipped`.
Cell clipped_cell(Surface surface, Cell cell, Light light, PlanarReceiver receiver, float eta, uint part, bool is_clipped) {
    bool sends[3] = bool[](true, true, true);
    for (int i = 0; i < (is_clipped ? 3 : 0); i++) {
        vec2 st = place_in(cell, vec2(i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0));
        sends[i] = land(surface, leave(surface, light, eta, st), receiver).margin >= 0.0;
    }
    is_clipped = sends[0] != sends[1] || sends[0] != sends[2];
    // The boundary separates one corner, a, from the two others.
    uint alone = sends[1] == sends[2] ? 0 : sends[0] == sends[2] ? 1 : 2;
    bool sends_alone = sends[alone];
    vec2 corners[3] = vec2[](cell.corner, cell.corner + cell.sides[0], cell.corner + cell.sides[1]);
    vec2 a = corners[alone];
    vec2 b = corners[(alone + 1) % 3];
    vec2 c = corners[(alone + 2) % 3];
    vec2 on_ab = edge_between(surface, light, receiver, eta, sends_alone ? a : b, sends_alone ? b : a, is_clipped);
    vec2 on_ac = edge_between(surface, light, receiver, eta, sends_alone ? a : c, sends_alone ? c : a, is_clipped);
    if (!is_clipped) return cell;
    if (sends_alone) return cell_between(a, on_ab, on_ac);
    return part == 0 ? cell_between(b, c, on_ac) : cell_between(b, on_ac, on_ab);
}
