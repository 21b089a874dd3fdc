// Constants that the host and the shaders share. build.rs makes Rust constants of the same names of them, with the
// comment above each as documentation.

// Ids of the specialisation constants, each of which is a bool of the same name: what the scene has, by which shaders leave
// out code.
const int ID_ONLY_MIRRORS = 0;
const int ID_AREA_BY_PRODUCT = 1;
const int ID_BEAMS = 2;
const int ID_HAS_LAMPS = 3;
const int ID_HAS_ENVIRONMENT = 4;
const int ID_HAS_ATLAS = 5;
const int ID_HAS_POINTS = 6;
const int ID_HAS_TEXTURES = 7;
const int ID_DISPERSES = 8;
// The light of chains is counted by where it ends, for a report.
const int ID_COUNTS_FLUX = 9;
// A sun or lamp may be in the picture.
const int ID_SHOWS_LIGHTS = 10;
// Triangles of casters may be merged.
const int ID_HAS_MERGED = 11;
// Pictures have one sample a pixel.
const int ID_ONE_SAMPLE = 12;

// `Triangle.flags`: the triangle casts shadows.
const uint OCCLUDES = 1;
// `Triangle.flags`: the triangle belongs to a mesh receiver.
const uint IS_MESH_RECEIVER = 2;
// `Triangle.flags`: the triangle casts shadows in the direct light of the environment.
const uint OCCLUDES_ENVIRONMENT = 4;
// `Triangle.flags`: several triangles of a caster, merged. `twin` leads to the triangle of the midpoints of its sides 01, 12
// and 20.
const uint MERGED = 8;

// `Object.kind`.
const uint DIFFUSE = 0;
const uint MIRROR = 1;
const uint CONDUCTOR = 2;
const uint DIELECTRIC = 3;
// `Object.shape` of a mesh receiver, and of dielectrics: of a sheet, of a closed body without a receiver in it, and of a surface whose
// refracted light chains disperse.
const uint MESH = 1;
const uint SHEET = 2;
const uint SOLID = 3;
const uint DISPERSING = 4;
// Steps of the table of the colours of wavelengths.
const uint SPECTRAL_STEPS = 256;
// Maximum number of rays of chains that leave the lights.
const uint MAX_RAYS = 524288;
// Maximum number of bands of the spectrum that rays of chains carry one each.
const uint MAX_BANDS = 8;
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
// Threads of a workgroup that refits the hierarchy: the most that every device has.
const uint REFIT_GROUP = 128;

// The coarsest level of any light map.
const int MAX_LEVEL = 5;
// Texels on the shorter side of the coarsest level.
const uint MIN_COARSE_SIDE = 16;
// Rows of the coarser level that a thread of resolve.comp adds.
const int RESOLVE_ROWS = 4;

// Workgroup size of the shaders that have a thread for each unit: patches, pairs, splats, rays or points.
const uint SPLAT_GROUP = 64;
// Sides of a workgroup of the shaders that have a thread for each texel or pixel.
const uint GROUP_SIDE = 8;
// Workgroups in a row of a dispatch that every device supports.
const uint MAX_ROW = 65535;
// Pairs per thread of compact.comp. Sums within a group are the main cost, so there are few groups.
const uint PAIRS_PER_THREAD = 8;
// Corners of the two triangles of a quad; see quad.glsl.
const uint QUAD_CORNERS[6] = uint[](0, 1, 2, 2, 1, 3);

// Words of the totals that scan.comp writes: before the first batch, and of each batch.
const uint ARGUMENT_WORDS = 9;
// The word of the total of the first sum, and in the sizes of a wave of chains that of the number of paths.
const int UNITS_WORD = 6;
// The word of the total of the second sum.
const int SECOND_UNITS_WORD = 7;
// The first word of the draw within the words of a batch.
const uint BATCH_DRAW_WORD = 3;
// Words of the sizes of a wave that scan_chains.comp writes.
const uint WAVE_WORDS = 13;
// The word of the number of landings on mesh receivers in earlier waves.
const int LANDINGS_WORD = 3;
// `ChainHit.footprints`: light reaches a mesh receiver before the hit. The other bits are the number of footprints on planar receivers.
const uint ON_MESHES = 0x80000000u;
// The word of the number of footprints of earlier waves.
const int FOOTPRINTS_WORD = 7;
// The first word of the draw within the words of a wave.
const int WAVE_DRAW_WORD = 8;

// Entries of the balance of flux, see src/flux_balance.rs: what comes in, and where it ends.
const uint FLUX_INCOMING = 0;
const uint FLUX_ON_OTHER_SURFACES = 1;
const uint FLUX_IN_MEDIA = 2;
const uint FLUX_IN_MIRRORS = 3;
const uint FLUX_LEFT_SCENE = 4;
const uint FLUX_CUT_FAINT = 5;
const uint FLUX_CUT_WEAK = 6;
const uint FLUX_CUT_INTERFACES = 7;
const uint FLUX_CUT_ROOM = 8;
const uint FLUX_CUT_NORMALS = 9;
const uint FLUX_SAMPLING = 10;
// The first of the entries of light that landed on receivers, by number of surfaces from 1 on, and their number. The last one has
// light of more surfaces, too.
const uint FLUX_LANDED = 11;
const uint LANDED_ENTRIES = 64;
// Number of entries: FLUX_LANDED + LANDED_ENTRIES.
const uint FLUX_ENTRIES = 75;

// Footprints of a patch on a planar receiver for one lobe: the footprint and its fold.
const uint FOOTPRINT_SLOTS = 2;
// Footprints of a patch on a mesh receiver for one lobe.
const uint MESH_FOOTPRINT_SLOTS = 32;
// Places on a patch cluster where rays start; each stands for an equal share of its surface.
const uint CLUSTER_STARTS = 4;
// Exponent p of the sharpest kernel of the table of profiles. Flat patches use it.
const float SHARPEST = 7.0;
// The same of the sharpest kernel that curved patches use.
const float SHARPEST_CURVED = 4.0;

// Level k of patch shares is FIRST_SHARE / 2^k.
const uint SHARE_LEVELS = 14;
const float FIRST_SHARE = 0.0078125;
// A receiver's light is divided into at least this number of patches over the error to aim for: what blocks or bends light between
// corners that agree goes unseen by the estimate.
const float MIN_PATCHES_PER_ERROR = 8.0;
// `Facet.place`: the number of the facet among those of its triangle, and from this bit on their number along an edge.
const int FACET_DIVISION_SHIFT = 16;
// Positions in the packed triangles of a patch, see patch_splats.glsl: of the number of parts, of whether rays decide for each
// triangle, of whether the patch is clipped, and of the number of pieces of the light's disc.
const int PARTS_SHIFT = 8;
const int MIXED_SHIFT = 10;
const int CLIPPED_SHIFT = 11;
const int PIECES_SHIFT = 12;
// Height of an image over the blur below which it may be thin: see project_triangles.comp.
const float THIN_HEIGHT = 0.3;
// Largest number of pieces that a light's disc is divided into.
const uint MAX_PIECES = 16;
// Triangles of a receiver's whole flux over the number of patches, beyond four for each patch.
const float MAX_TRIANGLES_PER_PATCH = 24.0;
// `TriangleSplat.upper` of a splat that is drawn as the triangle around it, not as a rectangle.
const float AS_TRIANGLE = -1.0;
// `TriangleSplat.points` of a triangle that a parallelogram blurs, and of a kernel.
const float IS_BLURRED = 0.0;
const float IS_KERNEL = -1.0;
// Largest number of patches along an edge of a facet, and of triangles along an edge of a patch's image.
const uint MAX_PATCH_DIVISION = 1024;
const uint MAX_IMAGE_DIVISION = 32;

// Variance of the kernel of an environment cell over the cell's variance, so that neighbouring kernels add up evenly.
const float CELL_SPREAD = 1.3;

// Maximum number of samples along the filter of an environment, of pinhole.comp.
const int MAX_TAPS = 16;

// `DiffuseSurface.kind`: no diffuse surface; a rect with a tile of the direct map; a mesh with a light map, whose tile of the
// direct map has the same texels; another mesh, with values at points of its triangles.
const uint NO_SURFACE = 0;
const uint PLANE = 1;
const uint ATLAS = 2;
const uint POINTS = 3;

// A texel of a direct map has the square of this number of rays to each sun and lamp, where it is partly in shadow.
const uint LIGHT_RAYS_SIDE = 4;
// The same for a point of a mesh, and for a quarter of a texel of its light map.
const uint POINT_LIGHT_RAYS = 16;
// Side of a block of texels of a direct map that may be lit or dark as a whole.
const uint BLOCK = 8;
// A light has two bits in a block's words.
const uint LIGHTS_PER_WORD = 16;
// Lights that have a bit of their own in a texel. All bits together are an f32 value without rounding.
const uint MASKED_LIGHTS = 23;
// No light and no shadow; all in shadow; undecided.
const uint IS_LIT = 0;
const uint IS_DARK = 1;
const uint IS_MIXED = 2;

// Environment cells that texels have rays to, in groups of DIRECT_CELLS_SIDE^2 cells that are close together. A texel has a ray to
// one cell of each group: every cell is that of one of DIRECT_CELLS_SIDE^2 neighbouring texels.
const uint DIRECT_CELLS = 256;
const uint DIRECT_CELLS_SIDE = 4;
const uint DIRECT_CELL_GROUPS = 16;
// Texels whose neighbours do not stand for them have rays to one of so many cells of a group.
const uint DIRECT_CELLS_STEP = 4;
// Parts of the blocks of DIRECT_CELLS_SIDE^2 texels of a rect, by columns and rows modulo 2, which have their rays one after the other.
const uint ENVIRONMENT_PARTS = 4;

// Of the number of a visible triangle: it is seen by rays, since it reflects or refracts.
const uint BY_RAYS = 0x40000000u;

// Quads along a side of an environment cell, as an overlay draws it.
const uint CELL_PARTS = 4;
// `OverlayPush.shown`.
const uint SHOWS_DENSITY = 1;
const uint SHOWS_TEXELS = 2;
