// The structs that the host and the shaders share. Their Rust mirrors are in
// src/render/layout.rs; a test compares the offsets. Lengths in m, angles in rad.

const float PI = 3.14159265358979;

// Geometry of a triangle, in the order of the BVH's leaves.
struct Triangle {
    vec3 position;   // first corner
    uint object;
    vec3 edge1;      // second corner - first
    uint blocks;     // BLOCKS: casts shadows; IS_CURVED: of a curved receiver
    vec3 edge2;      // third corner - first
    uint twin;       // of a rect: index of its other triangle; of a mesh: of this one
};

const uint BLOCKS = 1;
const uint IS_CURVED = 2;

// Unit vertex normals of the triangle of the same index, and where its corners are on the light map
// of a curved receiver: (u, v) as unorm 2 x 16.
struct Normals {
    vec3 n0; uint uv0;
    vec3 n1; uint uv1;
    vec3 n2; uint uv2;
};

// The scene's bounds: a position is (x - lower) * scale steps from their corner.
struct Grid {
    vec3 lower;
    float unused0;
    vec3 scale;
    float unused1;
};

// Inner node of the bounding volume hierarchy with the boxes of its children: lower | upper << 16
// by axis, in steps of the grid. A link is the index of a node, or first triangle | count << 28.
struct Node {
    uvec3 left;
    uint left_link;
    uvec3 right;
    uint right_link;
};

const uint DIFFUSE = 0;
const uint MIRROR = 1;
const uint CONDUCTOR = 2;
const uint DIELECTRIC = 3;
const int NO_RECEIVER = -1;

struct Object {
    vec3 color;      // reflectance of a mirror, albedo of a diffuse surface
    uint kind;       // DIFFUSE, MIRROR, CONDUCTOR or DIELECTRIC
    vec3 index;      // of refraction of a conductor; of a dielectric behind its front over before it
    int receiver;    // index, or NO_RECEIVER
    vec3 extinction; // of a conductor
    uint is_curved;  // 1: the index is that of a Curved, 0: of a Receiver
};

// A sun, a lamp or a part of the sky; sun.glsl has what it is at a point.
struct Light {
    vec3 place;      // lamp: its middle; otherwise unit, toward it
    float size;      // sun: angular radius; lamp: radius
    vec3 power;      // lamp: W/sr; otherwise W/m^2 on a plane that faces it
    uint is_lamp;
    vec3 axis1;      // but for lamps: root of the covariance of its directions, rad
    float half_azimuth; // of the sky: half its range of azimuths, rad
    vec3 axis2;
    float half_sine;    // and of the sines of elevation
};

// A rectangle with a light map: the tile of the atlas from (tile_x, tile_y) on, v upward.
struct Receiver {
    vec3 origin;
    uint tile_x;
    vec3 edge_u;
    uint tile_y;
    vec3 edge_v;
    uint width;      // texels
    vec3 normal;     // unit
    uint height;     // texels
};

// A mesh with a light map: the tile of the atlas from (tile_x, tile_y) on, v upward. Its texels and
// samples are stored row by row from `first_texel` on. Its nodes are a quadtree over blocks of
// LEAF x LEAF texels, from `first_node` on, level by level: 2^levels leaves a side, then half as many,
// down to one.
struct Curved {
    uint tile_x;
    uint tile_y;
    uint width;      // texels
    uint height;
    uint first_texel;
    uint first_node;
    uint levels;
    uint unused;
};
const uint LEAF = 8;

// What of a curved receiver lies in a texel. Texels around a chart continue it: area 0.
struct AtlasTexel {
    vec3 position;   // centroid
    float area;      // m^2
    vec3 normal;     // mean of the triangles' over the area, so not longer than 1; 0: nothing
    uint source;     // of a texel around a chart: the nearest one in it, from first_texel on, or NO_TEXEL
};

// Points of a texel's four quarters on the triangles in them: weights of the second and third
// corner as unorm 2 x 16. NO_TRIANGLE where there is none.
struct AtlasSamples {
    uvec4 triangles;
    uvec4 weights;
};

// A square of texels of a curved receiver.
struct AtlasNode {
    vec3 centre;     // of a sphere around the texels' centroids
    float radius;    // < 0: no texel
    vec3 diagonal;   // of the texels' mean covariance: xx, yy, zz
    float widest;    // the largest trace of a texel's covariance, m^2
    vec3 beside;     // xy, xz, yz
    float sine;      // of the angle of a cone around all normals; 2 from 90 degrees on
    vec3 axis;       // of the cone
    float unused;
};

// A mirror's triangle and how many patches are made of it: subdivision^2.
struct Reflector {
    uint triangle;
    uint first_patch;
    uint subdivision;
    uint share_end;  // share of the area up to and with this one, in units of 2^-32
};

// A sample point of a specular surface: a small triangle with interpolated normals.
struct Patch {
    vec3 position;   // centroid
    uint triangle;
    vec3 normal;     // interpolated at the centroid, not normalised
    float area;
    vec3 edge1;
    uint object;
    vec3 edge2;
    float unused0;
    vec3 bend1;      // change of the interpolated normal along edge1
    float unused1;
    vec3 bend2;      // and along edge2
    float unused2;
};

// The image of a light in a patch on a receiver: with d the way from `centre` in texels of the
// atlas, along = 1 + slant . d and s^2 = 1 + 2 slant . d + bulge . d^2, the irradiance is
// peak * kernel_value(flatness, d^T conic d / s^2) * along / s^4 * clamp(cut.z + cut.xy . d, 0, 1).
struct Footprint {
    vec2 centre;
    vec2 slant;      // of the ray to the centre: its part in the plane, in texels, over its length squared
    vec3 conic;      // xx, xy, yy of the matrix; it includes the support radius
    float flatness;  // of the kernel
    vec3 peak;       // W/m^2
    float bulge_x;   // squared size of a texel over squared length of the ray
    vec3 cut;        // the share of a texel that lies before the patch's plane
    float bulge_y;
    vec2 lower;      // corners of what it covers in the atlas
    vec2 upper;
};

// The image of a part of the sky in a patch on a receiver. With q = (texel - foot, 1) over the length s of the way to the
// texel over the patch's height, s^2 = 1 + dot(size, (texel - foot)^2), and b = bend_at(cosine . q, ratio), the part is
// seen within |u| < 1 and |v| < 1, u = (east . q + normal.y b) / (ahead . q + normal.x b),
// v = up . q + normal.z b - sine - shear u, and its irradiance there is radiance * cosine . q / s^3 times what
// the surface lets through.
struct LightImage {
    vec2 foot;       // of the patch on the receiver's plane, in the atlas
    vec2 lower;      // corners of what it covers in the atlas
    vec2 upper;
    vec2 size;       // squared, of a texel over the patch's height
    vec3 ahead;
    float sharp_azimuth; // one over the half width of the edges
    vec3 east;
    float sharp_sine;
    vec3 up;
    float shear;
    vec3 cosine;
    float sine;
    vec3 radiance;   // W/m^2, reflected or beyond, times the patch's area over its squared height
    float ratio;     // index of refraction on the far side of the surface from here over that on this side; 1 for mirrors
    vec3 normal;     // the surface's in (ahead, east, up) of the sky; 0 for mirrored light
    float reflects;  // 1: light that a transparent surface mirrors; 0: that it lets through, or of a mirror
};

// The image of a light in a patch on a node of a curved receiver. With q the way from `centre` to a
// texel's centroid, size = 1 + growth along . q, and d = (u . q, v . q) / size in texels, irradiance
// peak / size^2 * kernel_value(flatness, d^T conic d) * max(-way . normal, 0) unless blocked, way that of
// the light there, of which the part along the ray is 1.
struct Spot {
    vec3 centre;
    float flatness;  // of the kernel
    vec3 u;          // across the ray, 1/m
    float before;    // from the patch to the centre, m
    vec3 v;
    uint low;        // corners of what it covers in the atlas: x | y << 16
    vec3 along;      // unit, the way of the light
    uint high;
    vec3 conic;      // xx, xy, yy of the matrix; it includes the support radius
    float tolerance; // m
    vec3 peak;       // W/m^2
    int base;        // texel (x, y) of the atlas is number base + x + y stride
    vec3 hit;        // what the ray meets first, if anything
    int stride;
    vec3 front;      // unit normal there, toward the light; 0: nothing
    float growth;    // of the light's width by the way along the ray, over the width, 1/m
};

// A patch's light on a receiver: a triangle of even irradiance.
struct Beam {
    vec3 irradiance; // W/m^2
    float unused0;
    vec2 corner0;    // in texels of the atlas, each next one counter-clockwise: cross2 > 0
    vec2 corner1;
    vec2 corner2;
    vec2 lower;      // corners of the texels of the atlas that it may touch
    vec2 upper;
    vec2 unused1;
};

// A point's flux over its texel's area.
struct PointSplat {
    vec3 irradiance; // W/m^2
    uint texel;      // x | y << 16 in the atlas, or NO_TEXEL
};
const uint NO_TEXEL = 0xffffffffu;

// A kernel of the family in kernel.glsl; see profiles() in src/render/kernel.rs.
struct Profile {
    float flatness;
    float support;   // squared support radius in units of the covariance
    float mean;      // integral of the kernel over t from 0 to 1
    float unused;
};
