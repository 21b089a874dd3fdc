// project_triangles: writes the triangles that stand for the images of the patches.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
NODES(2)
OBJECTS(3)
LIGHTS(4)
PLANAR_RECEIVERS(5)
FACETS(6)
layout(std430, binding = 7) readonly buffer Patches { FacetPatches facet_patches[]; };
layout(std430, binding = 8) readonly buffer PatchSums { uvec2 patch_sums[]; }; // see blocks.glsl: patches, patch corners
layout(std430, binding = 9) readonly buffer PatchNumbers { uvec2 patch_numbers[]; };
layout(std430, binding = 10) readonly buffer Totals { uint totals[]; };
layout(std430, binding = 11) readonly buffer SplatNumbers { uvec2 splat_numbers[]; }; // triangles, lit patches
layout(std430, binding = 12) readonly buffer PatchSplats { uint patch_splats[]; }; // per patch and target: see patch_splats.glsl
layout(std430, binding = 13) readonly buffer SplatSums { uvec2 splat_sums[]; }; // triangles, lit patches
layout(std430, binding = 14) readonly buffer SplatTotals { uint splat_totals[]; };
layout(std430, binding = 15) writeonly buffer TriangleSplats { TriangleSplat triangle_splats[]; };
layout(std430, binding = 16) readonly buffer Profiles { Profile profiles[]; };
layout(std430, binding = 17) buffer Coarse { uint coarse[]; }; // per receiver: bit l is set where splats are in level l
FACET_IMAGES(18)
#include "facet_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "kernel_fit.glsl"
#include "outer_corner.glsl"
#include "planar_receiver.glsl"
#include "level_kernel.glsl"
#include "facet.glsl"
#include "facet_image.glsl"
#include "facet_rays.glsl"
#include "disc_pieces.glsl"
#include "patch_splats.glsl"
#include "blocks.glsl"
#include "find_patch.glsl"

#define BLOCK_SPLATS(i) splat_sums[i].x
#define FIRST_SPLAT(i) splat_numbers[i].x

// For measurements: beams take the product of two lengths for the area of an image, see product_over_area().
layout(constant_id = ID_AREA_BY_PRODUCT) const bool AREA_BY_PRODUCT = false;

// Lower bound on the length and height of a triangle over the blur, so that no area is zero.
const float MIN_THICKNESS = 1.0 / 16.0;
// At folds and foci the light's disc shapes the image, and a parallelogram has another profile. An image is thin if its height is less than
// THIN_HEIGHT of the blur, and in addition either the height of the whole facet's image is, or the density changes by more than this
// share within the blur. Points stand for its disc, so that it has its exact share of every texel, or it becomes a kernel where these
// would be too far apart. With parallelograms only, `bumps` at 256^2 kept an error of 3.7 % however fine the patches.
const float THIN_CHANGE = 0.1;
// Variance of a disc, along its longer axis, below which one point stands for it, and up to which points do, texels^2. Between points that
// are farther apart than a texel there would be gaps.
const float LEAST_DISC = 1e-3;
const float WIDEST_DISC = 0.25;
// Variance of a kernel over the variance of its patch's image.
const float KERNEL_SPREAD = 1.5;

// A splat is drawn as the triangle around it where that has less than this area of its bounding rectangle: one triangle
// costs less than two.
const float MAX_AREA = 1.5;

// The variance along the narrower axis of a covariance, in texels^2.
float narrow_variance(vec3 covariance, float determinant) {
    return clamp(minor_eigenvalue(covariance, determinant), 0.0, 1e6);
}

// The texels of `level` whose centres are between `low` and `high`, which have no perspective yet. Returns whether there are
// any.
bool set_bounds(inout TriangleSplat splat, SplatLevel level, vec2 centre, vec2 low, vec2 high) {
    vec2 tile_low, tile_high;
    level_bounds(level.tile, level.level, tile_low, tile_high);
    if (splat.slant != vec2(0.0)) {
        low -= centre;
        high -= centre;
        add_perspective(splat.slant, vec4(tile_low - centre, tile_high - centre), low, high);
        low += centre;
        high += centre;
    }
    splat.lower = floor(clamp(low + 0.5, tile_low, tile_high));
    splat.upper = ceil(clamp(high - 0.5, tile_low, tile_high));
    return all(lessThan(splat.lower, splat.upper));
}

// Whether the image is thin at a fold. `elements` are its area elements.
bool is_thin_fold(CellImage image, vec3 elements, float height, float facet_height) {
    float blur = blur_side(image);
    float most = max(max(elements.x, elements.y), elements.z);
    float least = min(min(elements.x, elements.y), elements.z);
    float mean = abs(elements.x + elements.y + elements.z) / 3.0;
    bool is_fold = facet_height < THIN_HEIGHT * blur || (most - least) * blur > THIN_CHANGE * mean * height;
    return is_fold && height < THIN_HEIGHT * blur;
}

// `TriangleSplat.points` of the image. A parallelogram that is not just a texel covers the texels unevenly: with parallelograms and kernels
// of narrow discs, `corner` kept an error of 4 % on 17 mm wide texels.
float points_for(CellImage image, bool is_thin) {
    if (!is_thin || image.slant != vec2(0.0)) return IS_BLURRED;
    vec3 m = covariance_of(image.of_light);
    float major = 0.5 * (m.x + m.z) + length(vec2(0.5 * (m.x - m.z), m.y));
    return major < LEAST_DISC ? 1.0 : major < WIDEST_DISC ? DISC_POINTS : IS_BLURRED;
}

// Relative irradiance at the corners, from the area elements there: flux is conserved, so irradiance is the cosine over the
// area element. Near folds, and where the triangle is no wider than the blur, it is constant.
vec3 densities(CellImage image, vec3 elements, float height) {
    if (near_fold(image, elements)) return vec3(1.0);
    if (BEAMS) return vec3(1.0);
    vec3 density = image.density / abs(elements);
    float mean = dot(density, vec3(1.0 / 3.0));
    if (!(mean > 0.0)) return vec3(1.0);
    float sharp = clamp((height / blur_side(image) - 0.5) / 1.5, 0.0, 1.0);
    return 1.0 + (density / mean - 1.0) * sharp;
}

// Stretches a triangle that a focus or a fold has made thinner than MIN_THICKNESS: lengthens the longest side, and
// moves the opposite corner away from that side. Orders the corners counter-clockwise: cross2 > 0.
void widen(inout vec2 q[3], inout vec3 density) {
    int apex = 0;
    float longest = -1.0;
    for (int i = 0; i < 3; i++) {
        float side = distance(q[(i + 1) % 3], q[(i + 2) % 3]);
        if (side > longest) {
            longest = side;
            apex = i;
        }
    }
    int from = (apex + 1) % 3;
    int to = (apex + 2) % 3;
    vec2 along = longest > 0.0 ? (q[to] - q[from]) / longest : vec2(1.0, 0.0);
    float height = cross2(along, q[apex] - q[from]);
    if (longest < MIN_THICKNESS || abs(height) < MIN_THICKNESS) {
        density = vec3(1.0);
        q[to] += max(MIN_THICKNESS - longest, 0.0) * along;
        float more = max(MIN_THICKNESS - abs(height), 0.0);
        q[apex] += (height < 0.0 ? -more : more) * vec2(-along.y, along.x);
    }
    if (height < 0.0) {
        vec2 last = q[2];
        q[2] = q[1];
        q[1] = last;
        density = density.xzy;
    }
}

// Error of a common approximation: length(dFdx(x)) * length(dFdy(x)) over the true area length(cross(dFdx(x),
// dFdy(x))), where x is the position on the caster that lights a texel. The ratio is 1 / sin of the angle between the
// derivatives.
float product_over_area(Surface surface, Cell cell, CellImage image) {
    vec2 side1 = image.corners[1] - image.corners[0];
    vec2 side2 = image.corners[2] - image.corners[0];
    vec3 edge1 = cell.sides[0].x * surface.edge1 + cell.sides[0].y * surface.edge2;
    vec3 edge2 = cell.sides[1].x * surface.edge1 + cell.sides[1].y * surface.edge2;
    vec3 dx = edge1 * side2.y - edge2 * side1.y; // times the determinant
    vec3 dy = edge2 * side1.x - edge1 * side2.x;
    float area = length(cross(edge1, edge2)) * abs(cross2(side1, side2));
    // An image without area has no texels.
    return area > 0.0 ? length(dx) * length(dy) / area : 0.0;
}

// The image as a kernel. Returns whether it lights the receiver's texels; `level` is the level that they belong to.
bool kernel_splat(CellImage image, PlanarReceiver receiver, out TriangleSplat splat, out int level) {
    vec2 centre = (image.midpoints[0] + image.midpoints[1] + image.midpoints[2]) / 3.0;
    // Root of the covariance of the triangle between the midpoints.
    mat2 of_patch = mat2((image.midpoints[0] - image.midpoints[1]) * sqrt(1.0 / 6.0), (image.midpoints[2] - centre) * sqrt(0.5));
    Kernel kernel = kernel_for(of_patch * sqrt(KERNEL_SPREAD), image.of_light, 1.0 / 12.0, SHARPEST_CURVED);
    SplatLevel target = splat_level(receiver, narrow_variance(kernel.covariance, kernel.determinant));
    level = target.level;
    LevelKernel here = on_level(kernel, centre, target);
    splat.slant = image.slant / target.scale;
    if (!set_bounds(splat, target, here.centre, here.centre - here.half_size, here.centre + here.half_size) || !(here.kernel.determinant > 0.0)) return false;
    splat.origin = here.centre;
    float peak = peak_of(here.kernel);
    splat.irradiance = image.flux * peak / target.area;
    // The sum over texels of a small kernel differs from its integral.
    if (is_small(here)) {
        float sum = sum_over_texels(here, false, vec2(0.0), vec3(0.0, 0.0, 1.0));
        if (sum > 0.0) splat.irradiance /= sum * peak;
    }
    splat.blur = vec4(conic_of(here.kernel), here.kernel.profile.flatness);
    splat.corners01 = vec4(0.0);
    splat.corner2 = vec2(0.0);
    splat.density12 = vec2(0.0);
    splat.points = IS_KERNEL;
    return true;
}

// Whether the triangle around the splat lies on the level and has less area than MAX_AREA times the rectangle.
bool is_small_around(TriangleSplat splat, SplatLevel level) {
    vec2 corners[3];
    for (int i = 0; i < 3; i++) corners[i] = splat.lower + outer_corner(splat, i);
    vec2 tile_low, tile_high;
    level_bounds(level.tile, level.level, tile_low, tile_high);
    vec2 low = min(min(corners[0], corners[1]), corners[2]);
    vec2 high = max(max(corners[0], corners[1]), corners[2]);
    vec2 box = splat.upper - splat.lower;
    float doubled = abs(cross2(corners[1] - corners[0], corners[2] - corners[0]));
    return all(greaterThanEqual(low, tile_low)) && all(lessThanEqual(high, tile_high)) && doubled < 2.0 * MAX_AREA * box.x * box.y;
}

// The image as a triangle, with these points for the disc. Returns whether it lights the receiver's texels; `level` is the level that
// they belong to.
bool triangle_splat(CellImage image, vec3 elements, float height, float points, PlanarReceiver receiver, out TriangleSplat splat, out int level) {
    bool is_blurred = points == IS_BLURRED;
    SplatLevel target = splat_level(receiver, is_blurred ? narrow_variance(image.blur, image.blur_determinant) : 0.0);
    level = target.level;
    float square = target.scale * target.scale;
    float determinant = is_blurred ? determinant_of(target.scale * image.of_light, square * (1.0 / 12.0 - target.variance)) : 1.0 / 144.0;
    mat2 blur = is_blurred ? blur_box(square * (image.blur - target.variance * vec3(1.0, 0.0, 1.0)), determinant) : mat2(1.0);
    mat2 disc = points > 1.0 ? symmetric_root(covariance_of(image.of_light), determinant_of(image.of_light, 0.0)) : mat2(0.0);
    vec2 centre = place_on(target, image.midpoints[1]);
    splat.slant = image.slant / target.scale;
    vec2 corners[3];
    for (int i = 0; i < 3; i++) corners[i] = centre + without_perspective(splat.slant, place_on(target, image.corners[i]) - centre);
    // With a margin for widen().
    vec2 beyond = 0.5 * (abs(blur[0]) + abs(blur[1])) * (1.0 + 2.0 * MIN_THICKNESS) + POINT_DISTANCE * max(abs(disc[0]), abs(disc[1]));
    if (!set_bounds(splat, target, centre, min(min(corners[0], corners[1]), corners[2]) - beyond,
        max(max(corners[0], corners[1]), corners[2]) + beyond)) return false;
    splat.origin = splat.slant == vec2(0.0) ? splat.lower : centre;
    vec3 density = densities(image, elements, height);
    mat2 to_box = mat2(blur[1].y, -blur[0].y, -blur[1].x, blur[0].x) / box_area(determinant);
    vec2 q[3];
    for (int i = 0; i < 3; i++) q[i] = to_box * (corners[i] - splat.origin);
    widen(q, density);
    float area = 0.5 * cross2(q[1] - q[0], q[2] - q[0]) * box_area(determinant);
    if (is_blurred) disc = to_box;
    splat.blur = vec4(disc[0], disc[1]);
    splat.corners01 = vec4(q[0], q[1]);
    splat.corner2 = q[2];
    splat.density12 = density.yz;
    splat.points = points;
    splat.irradiance = image.flux / (area * target.area);
    if (splat.slant == vec2(0.0) && is_small_around(splat, target)) splat.upper = vec2(AS_TRIANGLE);
    return true;
}

// Moves a place of the image by `aside`, where there is no perspective.
vec2 moved_aside(vec2 place, vec2 centre, vec2 slant, vec2 aside) {
    vec2 flat_ = without_perspective(slant, place - centre) + aside;
    return centre + flat_ / max(1.0 - dot(slant, flat_), 0.1);
}

// The image by one piece of the disc. Perspective is affine over so small a piece.
void take_piece(inout CellImage image, uint index, uint pieces) {
    if (pieces == 1) return;
    Piece piece = piece_of(index, pieces);
    // The root of the disc's covariance is half its radius.
    vec2 aside = 2.0 * image.of_light * piece.centre;
    vec2 centre = image.midpoints[1];
    for (int i = 0; i < 3; i++) {
        image.corners[i] = moved_aside(image.corners[i], centre, image.slant, aside);
        image.midpoints[i] = moved_aside(image.midpoints[i], centre, image.slant, aside);
    }
    mat2 root = 2.0 * image.of_light * piece.root;
    // Derivative of the perspective at `aside`.
    float scale = 1.0 / max(1.0 - dot(image.slant, aside), 0.1);
    for (int i = 0; i < 2; i++) image.of_light[i] = scale * (root[i] + aside * (scale * dot(image.slant, root[i])));
    image.slant = vec2(0.0);
    set_blur(image);
    image.flux /= float(pieces);
}

// The splat for `cell` and a piece of the disc. Returns false where no light arrives.
bool project(Surface surface, Cell cell, Light light, uint index, float eta, bool is_mixed, float facet_height, uvec2 piece, out TriangleSplat splat) {
    PlanarReceiver receiver = planar_receiver_at(index);
    CellImage image = image_of(surface, cell, rays_of(surface, cell, light, eta), light, receiver);
    if (!image.is_lit || misses(image, receiver)) return false;
    if (is_mixed) {
        // Each piece of the disc has its own shadow.
        vec2 point = piece.y > 1 ? piece_of(piece.x, piece.y).centre : vec2(0.0);
        vec2 st = place_in(cell, vec2(1.0 / 3.0));
        vec2 low = vec2(receiver.tile_x, receiver.tile_y);
        vec2 middle = (image.corners[0] + image.corners[1] + image.corners[2]) / 3.0;
        middle = moved_aside(middle, image.midpoints[1], image.slant, 2.0 * image.of_light * point);
        vec2 texel = clamp(middle, low, low + vec2(receiver.width, receiver.height));
        if (!light_arrives(surface, light, eta, st, point) || !light_leaves(surface, st, receiver, texel)) return false;
    }
    take_piece(image, piece.x, piece.y);
    float height = height_of(image);
    int level;
    vec3 elements = area_elements(image);
    bool is_thin = is_thin_fold(image, elements, height, facet_height);
    float points = points_for(image, is_thin);
    if (points == IS_BLURRED && is_thin) {
        if (!kernel_splat(image, receiver, splat, level)) return false;
    } else {
        if (!triangle_splat(image, elements, height, points, receiver, splat, level)) return false;
        if (AREA_BY_PRODUCT) splat.irradiance *= product_over_area(surface, cell, image);
    }
    if (level > 0) atomicOr(coarse[index], 1u << level);
    return true;
}

void main() {
    uint index = push.first_splat + thread_index();
    uint slot = thread_index();
    if (index >= splat_totals[UNITS_WORD]) return;
    uint patch_count = totals[UNITS_WORD];
    SEARCH(block, 0, (patch_count + SPLAT_GROUP - 1) / SPLAT_GROUP, index, BLOCK_SPLATS)
    index -= splat_sums[block].x;
    uint first = block * SPLAT_GROUP;
    SEARCH(patch_index, first, min(SPLAT_GROUP, patch_count - first), index, FIRST_SPLAT)
    index -= splat_numbers[patch_index].x;
    uint count = push.lobes * push.receiver_count;
    uint target = 0;
    uint packed = patch_splats[patch_index * count];
    while (index >= splats_of(packed)) {
        index -= splats_of(packed);
        packed = patch_splats[patch_index * count + ++target];
    }
    PatchPlace place = find_patch(patch_index);
    Light light = light_toward(place.light_index, place.facet.triangle);
    Surface surface = surface_toward(place.facet.triangle, light);
    float eta = target % push.lobes == 0 ? 0.0 : surface.eta;
    PlanarReceiver receiver = planar_receiver_at(target / push.lobes);
    Cell cell = cell_of(facet_cell(place.facet), place.index, place.division);
    uint along = along_of(packed);
    uvec2 piece = uvec2(index % pieces_of(packed), pieces_of(packed));
    index /= piece.y;
    cell = clipped_cell(surface, cell, light, receiver, eta, index / (along * along), is_clipped_of(packed));
    cell = cell_of(cell, index % (along * along), along);
    float facet_height = unpackHalf2x16(facet_image_at(place.pair * push.receiver_count + target / push.lobes).height_blur).x;
    TriangleSplat splat;
    if (!project(surface, cell, light, target / push.lobes, eta, is_mixed_of(packed), facet_height, piece, splat)) splat.lower = splat.upper = vec2(0.0);
    triangle_splats[slot] = splat;
}
