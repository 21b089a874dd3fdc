// The camera's picture, as push constants of the graphics pipelines.

layout(push_constant) uniform CameraPush {
    vec3 eye;
    float near;          // m; nothing closer is seen
    vec3 right;          // half the picture's width at distance 1
    uint first;          // first of the triangles to draw
    vec3 up;             // half the picture's height at distance 1
    uint light_count;
    vec3 forward;        // unit
    float rotation;      // of the environment, rad
    vec2 size;           // of the picture, pixels
    vec2 tile;           // first pixel of the tile of the picture
} push;

#include "seen_at.glsl"
