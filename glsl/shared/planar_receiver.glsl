// Planar receivers: positions on their planes, texels of the light-map image, and coarser levels.

// Converts a position on the receiver's plane to texels of the light-map image.
vec2 to_texels(PlanarReceiver receiver, vec3 position) {
    vec3 offset = position - receiver.origin;
    float u = dot(offset, receiver.edge_u) / dot(receiver.edge_u, receiver.edge_u);
    float v = dot(offset, receiver.edge_v) / dot(receiver.edge_v, receiver.edge_v);
    vec2 size = vec2(receiver.width, receiver.height);
    return vec2(receiver.tile_x, receiver.tile_y) + vec2(u, 1.0 - v) * size;
}

// Whether a place in the light-map image is in the receiver's tile.
bool is_in_tile(PlanarReceiver receiver, vec2 place) {
    vec2 low = vec2(receiver.tile_x, receiver.tile_y);
    return all(greaterThanEqual(place, low)) && all(lessThan(place, low + vec2(receiver.width, receiver.height)));
}

// Converts texels of the light-map image to a position on the receiver's plane.
vec3 from_texels(PlanarReceiver receiver, vec2 texel) {
    vec2 uv = (texel - vec2(receiver.tile_x, receiver.tile_y)) / vec2(receiver.width, receiver.height);
    return receiver.origin + uv.x * receiver.edge_u + (1.0 - uv.y) * receiver.edge_v;
}

// Converts a direction in the receiver's plane to texels.
vec2 texel_direction(PlanarReceiver receiver, vec3 direction) {
    float u = dot(direction, receiver.edge_u) / dot(receiver.edge_u, receiver.edge_u);
    float v = dot(direction, receiver.edge_v) / dot(receiver.edge_v, receiver.edge_v);
    return vec2(u * float(receiver.width), -v * float(receiver.height));
}

// Where the end of a ray along r moves on the receiver's plane, in texels, if it moves by `change`, m, in space.
vec2 landing_change(PlanarReceiver receiver, vec3 r, vec3 change) {
    return texel_direction(receiver, change - r * (dot(change, receiver.normal) / dot(r, receiver.normal)));
}

// Area of a texel, m^2.
float texel_area(PlanarReceiver receiver) {
    return length(cross(receiver.edge_u, receiver.edge_v)) / float(receiver.width * receiver.height);
}

// Wide footprints are splatted into coarser levels of a light map. The levels lie beside the light map in the image,
// one below the other. A texel of level l is 2^l texels of the light map wide. Each level has a border of one texel,
// because levels are interpolated. padded() of src/render/receivers/light_maps.rs reserves the space.
int coarsest_level(PlanarReceiver receiver) {
    return clamp(findMSB(min(receiver.width, receiver.height) / MIN_COARSE_SIDE), 0, MAX_LEVEL);
}

// The coarsest level whose texels are no wider than the standard deviation. `variance` is in texel^2.
int level_for(PlanarReceiver receiver, float variance) {
    return clamp(findMSB(uint(variance)) / 2, 0, coarsest_level(receiver));
}

struct Level {
    ivec2 origin;    // in the light-map image
    ivec2 size;      // without the border
};

Level level_of(PlanarReceiver receiver, int level) {
    ivec2 size = ivec2(receiver.width, receiver.height);
    ivec2 origin = ivec2(receiver.tile_x, receiver.tile_y);
    if (level == 0) return Level(origin, size);
    origin += ivec2(size.x + 1, 1);
    for (int i = 1; i < level; i++) origin.y += ((size.y - 1) >> i) + 3;
    return Level(origin, ((size - 1) >> level) + 1);
}

// A level that splats go to. Interpolation of level l adds the variance (4^l - 1)/4 on each axis, so that splats are narrowed by
// that variance first.
struct SplatLevel {
    Level tile;
    int level;
    float scale;     // texels of the level over those of the light map
    vec2 origin;     // of the light map
    float variance;  // that interpolation adds, in texels^2 of the light map
    float area;      // of a texel of the level, m^2
};

// The coarsest level for splats with this variance along their narrower axis, in texels^2.
SplatLevel splat_level(PlanarReceiver receiver, float variance) {
    int level = level_for(receiver, variance);
    float width = float(1 << level);
    return SplatLevel(level_of(receiver, level), level, 1.0 / width, vec2(receiver.tile_x, receiver.tile_y),
        0.25 * (width * width - 1.0), width * width * texel_area(receiver));
}

// A place of the light map in a level.
vec2 place_on(SplatLevel level, vec2 texel) {
    return vec2(level.tile.origin) + (texel - level.origin) * level.scale;
}

// Bounds of a level with its border, in texels of the light-map image.
void level_bounds(Level tile, int level, out vec2 low, out vec2 high) {
    vec2 border = vec2(level > 0 ? 1.0 : 0.0);
    low = vec2(tile.origin) - border;
    high = vec2(tile.origin + tile.size) + border;
}
