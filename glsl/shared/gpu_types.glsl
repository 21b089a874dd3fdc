// The structs that the host and the shaders share. Their Rust mirrors are in src/render/gpu_types.rs; a unit test
// compares names, offsets and sizes. Lengths in m, angles in rad.

#include "constants.glsl"

const float PI = 3.14159265358979;
// Larger than any distance, m. GLSL does not guarantee infinities.
const float FAR = 3.0e38;

// Geometry of a triangle, in the order of the BVH's leaves.
struct Triangle {
    vec3 position;   // first corner
    uint object;
    vec3 edge1;      // second corner - first
    uint flags;      // OCCLUDES, OCCLUDES_ENVIRONMENT: casts shadows; IS_MESH_RECEIVER: belongs to a mesh receiver; MERGED
    vec3 edge2;      // third corner - first
    uint twin;       // rect: index of its other triangle; mesh: index of this triangle; merged: see MERGED
};

// Unit vertex normals of the triangle with the same index. On a mesh receiver also the corners' texture coordinates on
// the light map: (u, v) as unorm 2 x 16.
struct Normals {
    vec3 n0; uint uv0;
    vec3 n1; uint uv1;
    vec3 n2; uint uv2;
};

// Quantisation of the scene's bounds: the position x has the grid coordinates (x - lower) * scale.
struct Grid {
    vec3 lower;
    float unused0;
    vec3 scale;
    float unused1;
};

// Inner node of the bounding volume hierarchy, with the bounding boxes of its children: lower | upper << 16 for each
// axis, in grid coordinates. A link is the index of a node, or first triangle | count << COUNT_SHIFT for a leaf.
struct Node {
    uvec3 left;
    uint left_link;
    uvec3 right;
    uint right_link;
};

// The box of a node of the hierarchy.
struct NodeBox {
    vec3 lower;
    float unused;
    vec3 upper;
    float cost;      // sum of half the surface areas of this node and the inner nodes below, m^2
};

struct Object {
    vec3 color;      // mirror: reflectance; diffuse surface: albedo; dielectric: index of refraction of each colour channel's mean wavelength
    uint kind;       // DIFFUSE, MIRROR, CONDUCTOR or DIELECTRIC
    vec3 index;      // of refraction; dielectric: index behind the front face, priority, change of the index over the spectrum
    int receiver;    // index among the receivers of its kind, or NO_RECEIVER; dielectric: the first object with the same medium
    vec3 extinction; // conductor: extinction coefficient; dielectric: absorption, 1/m
    uint shape;      // MESH: `receiver` is the index of a MeshReceiver; SHEET, SOLID, DISPERSING or 0
};

// A sun, a lamp or a cell of the environment. light.glsl evaluates suns and lamps at a point.
struct Light {
    vec3 place;      // lamp: position of the centre; sun and cell: unit direction toward the centre
    float size;      // sun: angular radius; lamp: radius
    vec3 power;      // lamp: radiant intensity, W/sr; sun and cell: irradiance of a plane that faces the light, W/m^2
    uint is_lamp;
    vec3 axis1;      // sun and cell: axis1 and axis2 are a root of the covariance of the light's directions, rad; part of a lamp: centre and radius, in units of the lamp's radius
    float half_azimuth; // cell: half the range of azimuths, rad
    vec3 axis2;
    float half_sine;    // cell: half the range of the sine of elevation
};

// A rectangle with a light map. The light map is the tile of the image that starts at (tile_x, tile_y), v upward.
struct PlanarReceiver {
    vec3 origin;
    uint tile_x;
    vec3 edge_u;
    uint tile_y;
    vec3 edge_v;
    uint width;      // texels
    vec3 normal;     // unit
    uint height;     // texels
};

// Where the direct light of an object is.
struct DiffuseSurface {
    vec3 origin;     // rect: as of PlanarReceiver
    uint kind;       // NO_SURFACE, PLANE, ATLAS or POINTS
    vec3 edge_u;
    uint tile_x;     // tile of the direct map, v upward
    vec3 edge_v;
    uint tile_y;
    vec3 normal;     // unit
    uint width;      // texels of the direct map
    uint height;
    uint environment_scale;  // rect: texels of the direct map along a side of a texel of the direct map of the environment, whose tile has the same origin
    uint first_block; // rect: of its blocks, row by row
    uint triangle;   // rect: one of its triangles
    uint light_x;    // tile of the light map
    uint light_y;
    uint light_width; // texels of the light map; 0: none
    uint light_height;
};

// Texture of the triangle with the same index: coordinates of its corners in repeats of the image, v upward, and the image's
// levels among the TextureLevels.
struct TexturedTriangle {
    vec2 uv0;
    vec2 uv1;
    vec2 uv2;
    uint first_level;
    uint level_count; // 0: no texture
};

// A mipmap: a tile of the image of all textures.
struct TextureLevel {
    uvec2 origin;    // texel
    uvec2 size;
};

// The points of a triangle of kind POINTS: on a lattice of `division` intervals along each edge, row by row from the first
// corner on, from `first` on; where the division is 1, the triangle's corners, which it shares with others.
struct TrianglePoints {
    uint first;
    uint second;
    uint third;
    uint division;
};

// A point of a mesh: the triangle, and the weights of its second and third corner as unorm 2 x 16. `radius`: the point
// stands for the surface within it, m.
struct SurfacePoint {
    uint triangle;
    uint weights;
    float radius;
};

// A cell of the environment as a source of direct light.
struct DirectCell {
    vec3 mean;       // of the cell's directions, weighted by flux: at most 1 long
    float unused0;
    vec3 power;      // irradiance of a plane that faces the cell, W/m^2
    float unused1;
    vec3 direction;  // unit, of the shadow ray
    float unused2;
};

// A mesh with a light map. The light map is the tile of the image that starts at (tile_x, tile_y), v upward. The
// receiver's AtlasTexels and AtlasSamples are stored row by row from `first_texel` on. Its AtlasNodes form a quadtree
// over blocks of LEAF x LEAF texels. They are stored level by level from `first_node` on: 2^levels leaves per side,
// then half as many per side on each level, down to one.
struct MeshReceiver {
    uint tile_x;
    uint tile_y;
    uint width;      // texels
    uint height;
    uint first_texel;
    uint first_node;
    uint levels;
    uint unused;
};

// The part of a mesh receiver's surface in one texel. Texels around a chart extrapolate the surface and have area 0.
struct AtlasTexel {
    vec3 position;   // centroid
    float area;      // m^2
    vec3 normal;     // mean of the triangles' normals by area, so at most 1 long; 0: the texel is empty
    uint source;     // texel around a chart: index of the nearest texel in the chart, counted from first_texel; else NO_TEXEL
};

// One point on the surface in each quarter of a texel: the triangle, or NO_TRIANGLE where the quarter is empty, and the
// weights of the triangle's second and third corner as unorm 2 x 16.
struct AtlasSamples {
    uvec4 triangles;
    uvec4 weights;
};

// A node of a mesh receiver's quadtree: a square of texels.
struct AtlasNode {
    vec3 centre;     // of a sphere around the texels' centroids
    float radius;    // < 0: all texels are empty
    vec3 diagonal;   // of the texels' mean covariance: xx, yy, zz
    float max_trace; // the largest trace of a texel's covariance, m^2
    vec3 off_diagonal; // of the texels' mean covariance: xy, xz, yz
    float sine;      // of the half angle of a cone around all normals; 2 where the half angle is 90 degrees or more
    vec3 axis;       // of the cone
    float unused;
};

// A lit triangle of a caster. It is divided into subdivision^2 patches.
struct LitTriangle {
    uint triangle;
    uint first_patch;
    uint subdivision;
    uint share_end;  // share of the total area up to and including this triangle, in units of 2^-32
};

// A patch, the paper's sample point of a specular surface: a small triangle with interpolated normals.
struct Patch {
    vec3 position;   // centroid
    uint triangle;
    vec3 normal;     // interpolated at the centroid, not normalised
    float area;
    vec3 edge1;
    uint object;
    vec3 edge2;
    float unused0;
    vec3 normal_du;  // change of the interpolated normal along edge1
    float unused1;
    vec3 normal_dv;  // change of the interpolated normal along edge2
    float unused2;
};

// A place on a patch cluster where rays start.
struct ClusterStart {
    vec3 position;
    uint triangle;
    vec3 normal;     // interpolated, unit
    float unused;
};

// The image that a patch projects of an environment cell onto a planar receiver, as a kernel. Let d be the offset from `centre` in texels of the
// light-map image, along = 1 + slant . d and s^2 = 1 + 2 slant . d + bulge . d^2. The irradiance at d is
// peak * kernel_value(flatness, d^T conic d / s^2) * along / s^4 * clamp(clip.z + clip.xy . d, 0, 1).
struct Footprint {
    vec2 centre;
    vec2 slant;      // component in the plane of the ray to the centre, in texels, over the ray's squared length
    vec3 conic;      // matrix xx, xy, yy; includes the support radius
    float flatness;  // of the kernel
    vec3 peak;       // W/m^2
    float bulge_x;   // squared size of a texel over the squared length of the ray
    vec3 clip;       // linear function that clamps to the share of a texel in front of the patch's plane
    float bulge_y;
    vec2 lower;      // bounds in the light-map image, texels
    vec2 upper;
};

// The light of a landing of chains, in a level of a light map. Let d be the offset from `centre` in texels of the light-map image. The
// irradiance at d is irradiance * (kernel * kernel_value(flatness, d^T conic d) + share * parallelogram_value(sides.xy, sides.zw, d, true)).
struct ChainFootprint {
    vec3 conic;      // matrix xx, xy, yy; includes the support radius
    float flatness;  // of the kernel
    vec3 irradiance; // of all light in one texel, W/m^2
    float kernel;    // peak of the kernel in units of that
    vec4 sides;      // of the parallelogram, texels
    vec2 centre;
    vec2 lower;      // bounds in the light-map image, texels
    vec2 upper;
    float share;     // of the light in the parallelogram
    uint slant;      // of the kernel, as two halfs: see slant_of()
};

// The image that a patch projects of an environment cell onto a planar receiver. Let s be the distance from the patch to
// the texel over the patch's height, s^2 = 1 + dot(size, (texel - foot)^2), q = (texel - foot, 1) / s, and
// b = normal_coefficient(cosine . q, eta). The cell is visible where |u| < 1 and |v| < 1 with u = atan(east . q +
// normal.y b, ahead . q + normal.x b) / half_azimuth and v = up . q + normal.z b - sine - shear u.
// The irradiance there is radiance * mean_above(cosine . q / s, range) / s^3 times the Fresnel factor of the texel.
struct PinholeImage {
    vec2 foot;       // foot of the perpendicular from the patch to the receiver's plane, in the light-map image
    vec2 lower;      // bounds in the light-map image, texels
    vec2 upper;
    vec2 size;       // squared size of a texel over the squared height of the patch
    vec3 ahead;
    float sharp_azimuth; // one over the half width of the blurred edges
    vec3 east;
    float sharp_sine;
    vec3 up;
    uint shear_range; // two halves: shear; half the range of the cosine over the patch
    vec3 cosine;
    float sine;
    vec3 radiance;   // W/m^2: reflected or refracted radiance times the patch's area over its squared height
    float eta;       // index of refraction on the far side of the surface over that on the receiver's side; 1 for mirrors
    vec3 normal;     // the surface normal in the cell's axes (ahead, east, up); 0 for reflected light
    float half_azimuth;
};

// The image that a patch projects of a light onto a node of a mesh receiver. Let q be the offset from `centre` to a
// texel's centroid, size = 1 + growth direction . q, and d = (u . q, v . q) / size in texels. Where no occluder is in
// between, the irradiance is peak / size^2 * kernel_value(flatness, d^T conic d) * max(-w . normal, 0). w is the local
// direction of the light, scaled so that its component along `direction` is 1.
struct MeshFootprint {
    vec3 centre;
    float flatness;  // of the kernel
    vec3 u;          // across the ray, 1/m
    float travelled; // distance from the patch to the centre, m
    vec3 v;
    uint low;        // bounds in the light-map image: x | y << 16
    vec3 direction;  // unit direction in which the light travels
    uint high;
    vec3 conic;      // matrix xx, xy, yy; includes the support radius
    float tolerance; // m
    vec3 peak;       // W/m^2
    int base;        // the texel (x, y) of the image is number base + x + y stride
    vec3 occluder;   // the first point that the ray meets
    int stride;
    vec3 occluder_normal; // unit normal there, toward the light; 0: the ray meets nothing
    float growth;    // relative growth of the beam's width with distance along the ray, 1/m
};

// A caster's triangle, or one of the size^2 equal parts of a coarse one.
struct Facet {
    uint triangle;
    uint place;      // index of the part | size << FACET_DIVISION_SHIFT
    uint corner0;    // indices into FacetCorners
    uint corner1;
    uint corner2;
    float exposed;   // share of the triangle's outline at which the surface ends or bends
    uint along;      // triangles of the mesh along an edge, if it is merged; otherwise 0
    uint unused;
};

// A corner of facets: a point of a triangle, as coefficients of edge1 and edge2. Facets that share a smooth vertex share
// the corner.
struct FacetCorner {
    uint triangle;
    float s;
    float t;
};

// The patches of a facet under one light: division^2, or none.
struct FacetPatches {
    uint division;
    uint targets;     // bit t is set where the facet may light target t; a target is a receiver and a lobe
};

// A facet's image on a planar receiver, of both lobes.
struct FacetImage {
    float flux;               // W
    uint deviation_longest;   // two halves: largest distance of a midpoint from the straight side; longest side; texels; bit HAS_SHADOW_EDGE
    uint height_blur;         // two halves: height over that side; side of the blur's square; texels
    uint outline;             // two halves: height of the whole triangle's image, texels; Facet.exposed, or 0 for cells
};

// Sign bit of the first half of FacetImage.deviation_longest: a lobe's light is blocked at some corners of the facet and arrives from others.
const uint HAS_SHADOW_EDGE = 1u << 15;

// What a receiver's images are divided for.
struct ReceiverShare {
    float flux;        // of all facets, W
    float patch_share; // part of the flux that a patch has
    float error;       // estimated relative L1 error
    uint is_limited;   // 1: patch_budget is too small for the error to aim for
    uint pieces;       // of the light's disc for facets that show their outline
};

// The image of a part of a patch on a planar receiver: a triangle, blurred by the parallelogram that stands for a texel and the light's
// disc. Where it is thin, it is blurred by a texel and by points that stand for the disc, or it is a kernel. Positions are in texels of
// the light-map image, relative to `origin`.
struct TriangleSplat {
    vec4 blur;       // root of the disc's covariance, by columns; IS_BLURRED: matrix from texels to multiples of the parallelogram's
                     // sides; IS_KERNEL: conic, flatness
    vec4 corners01;  // corners in texels or in these multiples, counter-clockwise: cross2 > 0
    vec2 corner2;
    vec2 density12;  // relative irradiance at the second and third corner; the mean over the corners is 1
    vec3 irradiance; // W/m^2
    float points;    // that stand for the disc, 1 or DISC_POINTS; or IS_BLURRED or IS_KERNEL
    vec2 lower;      // bounds of the texels that the triangle may touch
    vec2 upper;      // AS_TRIANGLE: the bounds are the triangle in outer_corner.glsl
    vec2 origin;     // of the corners and the conic, in texels
    vec2 slant;      // perspective about the origin: see slant_of()
};

// A lattice of rays from a light to a caster. Ray (i, j) goes through origin + (i + 1/2) edge_u + (j + 1/2) edge_v and stands for
// a cell of the lattice. A sun's rays have one direction and start there, those of a lamp start in its centre.
struct ChainLattice {
    vec3 origin;
    uint first;      // number of the first ray
    vec3 edge_u;
    uint columns;
    vec3 edge_v;
    uint object;     // the caster: its surface is the first of the chains
    vec3 direction;  // sun: of the rays
    uint light;
    uint rows;
    uint refinements; // number of times that the spacing is halved for the error to aim for where all rays land and neighbours agree
    uint group_size; // lattices from the same light, or from all cells of the environment, to the same caster
    float middle;    // distance from the starts of its rays to the middle of the caster, m
    vec2 shift;      // of its rays, in cells
    vec2 unused;
};

// Where the ray through the middle of a lattice's cell lands.
struct PilotRay {
    float flux;      // W; 0: nowhere
    uint receiver;
    uint interfaces; // surfaces that it met, whether it is a chain, and how far its neighbours disagree: see pack_pilot()
    float dispersed; // extent of the spectrum where it lands, in standard deviations of the footprint
};

// What the pilot rays of a lattice say together. "Chains" have met two surfaces or more, or one that disperses their light.
struct LatticePilot {
    uint chains;        // number of cells by what is in them or the cells around them: some chain
    uint near_landings; // a chain that lands
    uint near_chains;   // a chain, and none that lands
    uint landings;      // chains that land
    vec2 incoherent;    // their flux, W, each times how far its neighbours, and other directions of the light, disagree
    float flux;         // of these, W
    float dispersed;    // of the rays: the largest
    float parts;        // of the spectrum, of chains that land: their sum
    float unused;
};

// How fine a lattice is to be.
struct LatticePlan {
    uint halvings;      // of cells near landings; NO_RAYS
    uint bands;         // of the spectrum
    uint light_halvings; // of the sides of the light, for the pieces of it that rays carry
    uint less_near_chains; // halvings that cells near chains that land nowhere have less
    uint less_elsewhere;   // those of cells near no chain
};

// The state of a chain: the ray that leaves a surface, and how it changes over a cell of the lattice and over the light.
// Changes are across the ray, in the axes of basis(direction): two of the place, then two of the direction.
struct ChainPath {
    vec3 position;
    uint triangle;   // where the ray starts, or NO_TRIANGLE
    vec3 direction;  // unit
    float first_flux; // largest channel of the cell's flux, W
    vec3 flux;       // W
    uint counts;     // interfaces | weak lobes << 8 | IS_DISPERSED | level of the lattice << 16 | halvings of the light << 18 | piece of the light << 20 | band << 24 | number of bands << 28
    vec4 cell_place;
    vec4 cell_direction;
    vec4 light_place;
    vec4 light_direction;
    uvec2 media;     // see media.glsl
    uvec2 start_or_spectrum; // ray of a lattice: the caster and the light; other rays: changes over the spectrum as four halfs
};

// What a chain's ray meets: an interface, a mirror or a diffuse surface. `media` are the media before that surface.
struct ChainHit {
    float distance;
    uint triangle;
    vec2 barycentric;
    uvec2 media;
    uint footprints; // number of footprints of the light that lands on planar receivers on the way; ON_MESHES: on mesh receivers, too.
                     // Of a landing on mesh receivers: number of its mesh footprints
    uint lobes;      // number of lobes that are followed
};

// The flux of one traced point over the area of the texel that it meets.
struct PointSplat {
    vec3 irradiance; // W/m^2
    uint texel;      // x | y << 16 in the light-map image, or NO_TEXEL
};

// A kernel of the family in kernel.glsl; profiles() of src/render/splat/kernel_profiles.rs makes the table.
struct Profile {
    float flatness;
    float support;   // squared support radius in units of the covariance
    float mean;      // integral of the kernel over t from 0 to 1
    float unused;
};

#include "texel_buffers.glsl"
