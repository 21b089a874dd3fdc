// trace_corners: finds whether light reaches the corners of patches and from there the receivers.
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
layout(std430, binding = 7) readonly buffer Corners { FacetCorner facet_corners[]; };
layout(std430, binding = 8) readonly buffer Patches { FacetPatches facet_patches[]; };
layout(std430, binding = 9) readonly buffer PatchSums { uvec2 patch_sums[]; }; // see blocks.glsl: patches, patch corners
layout(std430, binding = 10) readonly buffer PatchNumbers { uvec2 patch_numbers[]; };
layout(std430, binding = 11) readonly buffer Totals { uint totals[]; };
layout(std430, binding = 12) buffer Visibility { uint visibility[]; };
#include "facet_push.glsl"

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "planar_receiver.glsl"
#include "light_axes.glsl"
#include "disc_pieces.glsl"
#include "facet.glsl"
#include "facet_rays.glsl"
#include "facet_visibility.glsl"
#include "blocks.glsl"

#define BLOCK_POINTS(i) patch_sums[i].y
#define FIRST_POINT(i) patch_numbers[i].y

// Share of the way to the middle of the facet at which rays from its corners and sides start. On the side itself they may start in
// the plane of another surface, such as a wall around water, and would not meet it.
const float INWARD = 1e-3;

void main() {
    uint corners = push.corner_count * push.light_count;
    uint words = words_of_targets();
    uint index = thread_index() + (push.is_lattice != 0 ? corners : 0);
    uint light_index;
    uint triangle;
    vec2 st;
    uint targets;
    uint quadrant;
    if (push.is_lattice == 0) {
        // The targets of the facets around the corner.
        if (index >= corners || visibility[index * words] == 0) return;
        targets = visibility[index * words];
        light_index = index / push.corner_count;
        quadrant = index % push.corner_count * 2654435769u >> 30;
        FacetCorner corner = facet_corners[push.first_corner + index % push.corner_count];
        triangle = corner.triangle;
        st = vec2(corner.s, corner.t);
    } else {
        uint point = index - corners;
        if (point >= totals[SECOND_UNITS_WORD]) return;
        uint pairs = push.facet_count * push.light_count;
        SEARCH(block, 0, (pairs + SPLAT_GROUP - 1) / SPLAT_GROUP, point, BLOCK_POINTS)
        point -= patch_sums[block].y;
        uint first = block * SPLAT_GROUP;
        SEARCH(pair, first, min(SPLAT_GROUP, pairs - first), point, FIRST_POINT)
        FacetPatches patches = facet_patches[pair];
        uint n = patches.division;
        uvec2 place = lattice_place(point - patch_numbers[pair].y, n);
        // The facet's own corners are listed with the other facets' corners.
        if (place.x == n || place.y == n || place.x + place.y == 0) return;
        Facet facet = facet_at(push.first_facet + pair % push.facet_count);
        light_index = pair / push.facet_count;
        quadrant = place.x + 2 * place.y & 3u;
        triangle = facet.triangle;
        targets = patches.targets;
        st = place_in(facet_cell(facet), vec2(place) / float(n));
    }
    st = mix(st, vec2(1.0 / 3.0), INWARD);
    Light light = light_toward(light_index, triangle);
    Surface surface = surface_toward(triangle, light);
    OutgoingRay rays[2] = OutgoingRay[](leave(surface, light, 0.0, st), leave(surface, light, surface.eta, st));
    // Corners see several points of the disc, so that they disagree in penumbras, where the disc is then divided.
    vec2 point = push.error > 0.0 ? piece_of(quadrant, 4).centre : vec2(0.0);
    LightDisc disc = disc_at(light, position_at(surface, st));
    for (uint word = 0; word < words; word++) visibility[index * words + word] = 0;
    uint arrives = UNKNOWN;
    uint count = push.lobes * push.receiver_count;
    for (uint target = next_target(targets, 0, count); target < count; target = next_target(targets, target + 1, count)) {
        uint lobe = target % push.lobes;
        if (lobe == 1 && surface.eta == 0.0) continue;
        uint state = arrives == BLOCKED ? BLOCKED : UNKNOWN;
        if (arrives != BLOCKED) {
            PlanarReceiver receiver = planar_receiver_at(target / push.lobes);
            Landing landing = land(surface, rays[lobe], receiver);
            if (landing.margin >= 0.0 && is_inside(receiver, landing.texel)) {
                float eta = lobe == 0 ? 0.0 : surface.eta;
                vec3 n = normal_at(surface, st);
                DiscPart part = lit_part(surface, light, disc, n, eta);
                vec3 change = outgoing_change(part.direction, n, change_to(light, disc, part, point), vec3(0.0), eta);
                vec2 aside = landing_change(receiver, landing.part.direction, landing.distance_ * narrowed(landing.part, change));
                if (arrives == UNKNOWN) arrives = light_arrives(surface, light, eta, st, point) ? LIT : BLOCKED;
                state = arrives == LIT && light_leaves(surface, st, receiver, landing.texel + aside) ? LIT : BLOCKED;
            }
        }
        visibility[index * words + target / 16] |= state << 2 * (target % 16);
    }
}
