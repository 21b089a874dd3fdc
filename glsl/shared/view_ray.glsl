// The camera and a tile of its picture, as push constants of compute shaders.

layout(push_constant) uniform ViewPush {
    vec3 eye;
    uint light_count;
    vec3 right;          // half the picture's width at distance 1
    float rotation;      // of the environment, rad
    vec3 up;             // half the picture's height at distance 1
    uint side;           // side^2 samples per pixel
    vec3 forward;        // unit
    uint capacity;       // of the list of pixels
    vec2 size;           // of the picture, pixels
    uvec2 tile;          // first pixel of the tile, which `visible` has
    uvec2 first;         // list pixels: first pixel of this rectangle; shade: first item, and 1 for the items from the end
    uvec2 end;           // of the tile
} push;

// Luminances of a tile's pixels, W/m^2/sr, with the mean colours of textures in place of their detail. ELSEWHERE where a pixel
// shows anything else than one mirror or interface.
#define UNTEXTURED(slot, access) layout(std430, binding = slot) access buffer Untextured { float untextured[]; };
const float ELSEWHERE = 0.0;
const float LEAST_LUMINANCE = 1e-9;

// Index of a pixel among those of the tile.
uint index_in_tile(ivec2 pixel) {
    ivec2 place = pixel - ivec2(push.tile);
    return uint(place.y) * (push.end.x - push.tile.x) + uint(place.x);
}

// Unit direction through a place in the picture, pixels.
vec3 direction_at(vec2 pixel) {
    vec2 p = pixel / push.size * 2.0 - 1.0;
    return normalize(push.forward + p.x * push.right - p.y * push.up);
}
