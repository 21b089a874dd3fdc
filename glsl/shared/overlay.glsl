// Overlays: what a frame computed with, drawn over the camera's picture.

layout(push_constant) uniform OverlayPush {
    vec3 eye;            // the camera, as in camera.glsl
    float near;
    vec3 right;
    uint facet_count;
    vec3 up;
    uint light_count;
    vec3 forward;
    uint corner_count;
    vec2 size;           // of the picture, pixels
    uint receiver_count; // planar receivers
    uint lobes;
    float white;         // radiance that is shown as white before tone mapping, W/m^2/sr
    uint shown;          // SHOWS_DENSITY, SHOWS_TEXELS
    uint first;          // of the cells to draw
    uint is_sun;         // the cells act as suns
    uint every;          // one of so many kernels is outlined
    uint first_facet;    // of this frame's in the list of facets
} push;

#include "seen_at.glsl"

// Overlays lie nearer than the surfaces that they are drawn on, by this share of the distance.
const float NEARER = 1e-3;
// A place outside of the picture.
const vec4 NOWHERE = vec4(2.0, 2.0, 2.0, 1.0);

vec4 seen_over(vec3 position) {
    vec4 seen = seen_at(position);
    seen.z *= 1.0 + NEARER;
    return seen;
}
