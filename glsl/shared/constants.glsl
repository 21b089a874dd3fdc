// Constants that the host and the shaders share. build.rs makes Rust constants of the same names of them, with the
// comment above each as documentation.

// `Triangle.flags`: the triangle casts shadows.
const uint OCCLUDES = 1;
// `Triangle.flags`: the triangle belongs to a mesh receiver.
const uint IS_MESH_RECEIVER = 2;

// `Object.kind`.
const uint DIFFUSE = 0;
const uint MIRROR = 1;
const uint CONDUCTOR = 2;
const uint DIELECTRIC = 3;
// `Object.receiver` of an object that is none.
const int NO_RECEIVER = -1;

// `AtlasTexel.source` of a texel that lies in a chart, and `PointSplat.texel` of a point that meets no receiver.
const uint NO_TEXEL = 0xffffffffu;
// `AtlasSamples.triangles` of an empty quarter.
const uint NO_TRIANGLE = 0xffffffffu;
// Side of a leaf of a mesh receiver's quadtree, texels.
const uint LEAF = 8;

// Depth of the hierarchy that its traversal has a stack for.
const int STACK = 48;
// Position of the number of triangles in a link of the hierarchy.
const uint COUNT_SHIFT = 28;

// The coarsest level of any light map.
const int MAX_LEVEL = 5;
// Texels on the shorter side of the coarsest level.
const uint MIN_COARSE_SIDE = 16;

// Workgroup size of the projectors' shaders, of compact.comp and of resolve.comp.
const uint SPLAT_GROUP = 64;
// Pairs per thread of compact.comp. Sums within a group are the main cost, so there are few groups.
const uint PAIRS_PER_THREAD = 8;
// Footprints of a patch on a mesh receiver for one lobe.
const uint MESH_FOOTPRINT_SLOTS = 32;
// Places on a patch cluster where rays start; each stands for an equal share of its surface.
const uint CLUSTER_STARTS = 4;
// Exponent p of the sharpest kernel of the table of profiles. Flat patches use it.
const float SHARPEST = 7.0;

// Level k of patch shares is FIRST_SHARE / 2^k.
const uint SHARE_LEVELS = 14;
const float FIRST_SHARE = 0.0078125;
// A receiver's light is divided into at least this number of patches over the error to aim for: what blocks or bends light between
// corners that agree goes unseen by the estimate.
const float MIN_PATCHES_PER_ERROR = 8.0;
// Triangles of a receiver's whole flux over the number of patches, beyond four for each patch.
const float MAX_TRIANGLES_PER_PATCH = 24.0;
// `TriangleSplat.upper` of a splat that is drawn as the triangle around it, not as a rectangle.
const float AS_TRIANGLE = -1.0;
// `TriangleSplat.density0` of a kernel.
const float IS_KERNEL = -1.0;
// Largest number of patches along an edge of a facet, and of triangles along an edge of a patch's image.
const uint MAX_PATCH_DIVISION = 1024;
const uint MAX_IMAGE_DIVISION = 32;

// Maximum number of samples along the filter of an environment, of pinhole.comp.
const int MAX_TAPS = 16;

// A texel of a direct map has the square of this number of rays to each sun and lamp.
const uint DIRECT_RAYS_SIDE = 4;
// Rays of a texel of a direct map to the environment.
const uint DIRECT_ENVIRONMENT_RAYS = 64;
// Rays of a pixel to each sun or lamp, shared evenly by its samples.
const uint VIEW_LIGHT_RAYS = 16;
// Rays of a sample of a pixel to the environment.
const uint VIEW_ENVIRONMENT_RAYS = 32;
