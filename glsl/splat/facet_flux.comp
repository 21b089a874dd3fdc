// facet_flux: finds the receivers that each facet may light, and its flux there.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
OBJECTS(2)
LIGHTS(3)
PLANAR_RECEIVERS(4)
FACETS(5)
layout(std430, binding = 6) writeonly buffer Patches { FacetPatches facet_patches[]; };
layout(std430, binding = 7) writeonly buffer Images { FacetImage facet_images[]; }; // per pair and receiver
layout(std430, binding = 8) buffer Visibility { uint visibility[]; };
#include "facet_push.glsl"

#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "kernel.glsl"
#include "facet.glsl"
#include "facet_image.glsl"
#include "facet_visibility.glsl"
#include "blocks.glsl"

// Largest length that half precision holds, texels.
const float LARGEST = 6e4;

// Height of the image of the whole triangle that the facet is a part of, and the share of its outline at which the surface ends or bends.
// `height` is that of the facet's image. Parts of a sky are rectangles, whose profile is a parallelogram.
vec2 outline_of(Facet facet, Light light, float height) {
    return vec2(min(height * float(facet.place >> FACET_DIVISION_SHIFT), LARGEST), light.half_azimuth > 0.0 ? 0.0 : facet.exposed);
}

// Adds the facet's image by one lobe on `receiver`. Returns whether the facet may light the receiver.
bool add_image(Surface surface, Cell cell, CellRays rays, Light light, PlanarReceiver receiver, Facet facet, inout FacetImage sum) {
    CellImage image = image_of(surface, cell, rays, light, receiver);
    float deviation = deviation_of(image);
    float blur = blur_side(image);
    vec2 low = min(min(min(image.corners[0], image.corners[1]), image.corners[2]), min(min(image.midpoints[0], image.midpoints[1]), image.midpoints[2]));
    vec2 high = max(max(max(image.corners[0], image.corners[1]), image.corners[2]), max(max(image.midpoints[0], image.midpoints[1]), image.midpoints[2]));
    // The blur differs from place to place.
    float margin = 2.0 + deviation + 2.0 * sqrt(3.0 * max(image.blur.x, image.blur.z));
    vec2 tile_low = vec2(receiver.tile_x, receiver.tile_y);
    vec2 tile_high = tile_low + vec2(receiver.width, receiver.height);
    if (!image.is_lit || any(lessThan(high, tile_low - margin)) || any(greaterThan(low, tile_high + margin))) return false;
    vec2 inside = max(min(high, tile_high) - max(low, tile_low), 0.0) / max(high - low, 1e-6);
    float height = height_of(image);
    float flux = dot(image.flux, vec3(1.0 / 3.0)) * inside.x * inside.y;
    // The brighter lobe stands for both.
    if (flux >= sum.flux) {
        vec2 first = vec2(deviation, longest_side(image));
        sum.deviation_longest = packHalf2x16(min(first, LARGEST));
        sum.height_blur = packHalf2x16(min(vec2(height, blur), LARGEST));
        sum.outline = packHalf2x16(outline_of(facet, light, height));
    }
    sum.flux += flux;
    return true;
}

void main() {
    uint pair = thread_index();
    if (pair >= push.facet_count * push.light_count) return;
    Facet facet = facet_at(push.first_facet + pair % push.facet_count);
    Light light = light_toward(pair / push.facet_count, facet.triangle);
    Surface surface = surface_toward(facet.triangle, light);
    Cell cell = facet_cell(facet);
    // The back of a surface that only reflects is dark.
    LightDisc disc = disc_at(light, surface.position);
    bool is_lit = surface.eta != 0.0 || dot(surface.facing, disc.direction) + radius_of(light, disc) > 0.0;
    uint targets = 0;
    CellRays reflected = rays_of(surface, cell, light, 0.0);
    CellRays refracted;
    if (ONLY_MIRRORS) refracted = reflected; else refracted = rays_of(surface, cell, light, surface.eta);
    bool refracts = ONLY_MIRRORS ? false : surface.eta != 0.0 && push.lobes > 1 && !is_solid(surface.object) && !is_dispersing(surface.object, light);
    for (uint index = 0; index < push.receiver_count; index++) {
        PlanarReceiver receiver = planar_receiver_at(index);
        FacetImage sum = FacetImage(0.0, 0, 0, 0);
        if (is_lit && add_image(surface, cell, reflected, light, receiver, facet, sum)) targets |= target_bit(index * push.lobes);
        if (refracts && add_image(surface, cell, refracted, light, receiver, facet, sum)) targets |= target_bit(index * push.lobes + 1);
        facet_images[pair * push.receiver_count + index] = sum;
    }
    if (targets != 0) {
        uint first = pair / push.facet_count * push.corner_count;
        atomicOr(visibility[(first + facet.corner0) * words_of_targets()], targets);
        atomicOr(visibility[(first + facet.corner1) * words_of_targets()], targets);
        atomicOr(visibility[(first + facet.corner2) * words_of_targets()], targets);
    }
    facet_patches[pair] = FacetPatches(0, targets);
}
