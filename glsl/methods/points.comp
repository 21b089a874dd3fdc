// points: the simple baseline. Low-discrepancy points on the casters and in the lights' discs; each point is traced to
// the receivers and added to one texel.
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
layout(std430, binding = 6) readonly buffer LitTriangles { LitTriangle lit_triangles[]; };
layout(std430, binding = 7) writeonly buffer PointSplats { PointSplat splats[]; };
layout(std430, binding = 8) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 9) readonly buffer AtlasTexels { AtlasTexel atlas_texels[]; };
layout(push_constant) uniform PointsPush {
    uint first_point;   // first point of this batch
    uint batch_points;
    uint points;        // points for each light, over all batches
    uint lit_triangle_count;
    uint receiver_count; // planar receivers
    uint mesh_receiver_count;
    uint lobes;         // 1: reflected light; 2: also refracted light
    uint can_occlude;
    uint max_interfaces; // maximum number of specular surfaces on a chain; 1: no chains
    float area;         // total area of the lit triangles, m^2
    float spectral_middle; // coordinate of the wavelength of Object.index
} push;
layout(std430, binding = 10) readonly buffer Spectrum { vec4 weights_below[]; };

#include "trace.glsl"
#include "light.glsl"
#include "optics.glsl"
#include "media.glsl"
#include "chain_hit.glsl"
#include "planar_receiver.glsl"
#include "chain_ray.glsl"
#include "mesh_receiver.glsl"
#include "sampling.glsl"

// Additive recurrence of lowest discrepancy in five dimensions (Roberts 2018): fractional parts of the multiples of
// 1/g, 1/g^2, ... 1/g^5 with g^6 = g + 1, in units of 2^-32. The last is for wavelengths: the fractional part of the root of 2.
const uint STEPS[6] = uint[](3785032107u, 3335640777u, 2939605023u, 2590590015u, 2283013049u, 1779033703u);

uint fraction(uint point, int dimension) {
    return 0x80000000u + point * STEPS[dimension];
}

// The upper 24 bits, which a float in [0, 1) holds exactly.
float coordinate(uint point, int dimension) {
    return float(fraction(point, dimension) >> 8) / 16777216.0;
}

// Splats `flux`, W, onto the texel of the mesh receiver that a ray in the direction r hits. Returns false where it hits none.
bool project_to_mesh(vec3 r, uint triangle_, vec2 barycentric, vec3 flux, out PointSplat splat) {
    if (triangle_ == NO_TRIANGLE) return false;
    Triangle triangle = triangle_at(triangle_);
    bool front = dot(cross(triangle.edge1, triangle.edge2), r) < 0.0;
    if (!front || (triangle.flags & IS_MESH_RECEIVER) == 0) return false;
    MeshReceiver receiver = mesh_receivers[object_at(triangle.object).receiver];
    uvec2 size = uvec2(receiver.width, receiver.height);
    vec2 place = light_map_position(receiver, normals_at(triangle_), barycentric);
    uvec2 texel = min(uvec2(max(place, vec2(0.0))), size - 1);
    uint index = texel.x + texel.y * size.x;
    AtlasTexel own = atlas_texels[receiver.first_texel + index];
    if (own.area == 0.0) {
        // Rounding moved the point out of its chart.
        if (own.source == NO_TEXEL) return false;
        index = own.source;
        own = atlas_texels[receiver.first_texel + index];
    }
    uvec2 at = uvec2(receiver.tile_x, receiver.tile_y) + uvec2(index % size.x, index / size.x);
    splat = PointSplat(flux / own.area, at.x | at.y << 16);
    return true;
}

// Splats `flux` onto the texel of a planar receiver at a place in the light-map image. Returns false outside.
bool project_to_plane(PlanarReceiver receiver, vec2 place, vec3 flux, out PointSplat splat) {
    if (!is_in_tile(receiver, place)) return false;
    vec2 texel = floor(place);
    splat = PointSplat(flux / texel_area(receiver), uint(texel.x) | uint(texel.y) << 16);
    return true;
}

// Follows light that left its first surface to the next ones, along one lobe of each, and splats it where it lands. The slots of
// its targets begin at `first_slot`.
void follow(ChainPath path, uint point, uint first_slot) {
    for (;;) {
        ChainHit hit = hit_of(path);
        if (interfaces_of(path) > 1) {
            PointSplat splat;
            for (uint index = 0; index < push.receiver_count; index++) {
                PlanarReceiver receiver = planar_receiver_at(index);
                float distance_;
                vec2 place;
                if (!lands_on(path, hit, receiver, distance_, place)) continue;
                if (project_to_plane(receiver, place, flux_after(path, distance_), splat)) splats[first_slot + index] = splat;
            }
            if (push.mesh_receiver_count > 0 && project_to_mesh(path.direction, hit.triangle, hit.barycentric, flux_after(path, hit.distance), splat)) {
                splats[first_slot + push.receiver_count] = splat;
            }
        }
        Interaction at;
        if (interfaces_of(path) >= push.max_interfaces || !interact(path, hit, at)) return;
        Lobe lobe;
        bool refracts;
        if (!choose_lobe(path, at, choice(point * 17 + interfaces_of(path), 0), lobe, refracts)) return;
        path = next_ray(path, hit, at, lobe, refracts);
    }
}

void main() {
    uint local = gl_GlobalInvocationID.x;
    if (local >= push.batch_points) return;
    uint global = push.first_point + local;
    uint point = global % push.points;
    Light light = light_at(global / push.points);
    // Targets of each lobe: the planar receivers, then the nearest mesh.
    uint targets_per_lobe = push.receiver_count + min(push.mesh_receiver_count, 1);
    uint targets = push.lobes * targets_per_lobe;
    for (uint i = 0; i < targets; i++) splats[local * targets + i].texel = NO_TEXEL;

    // Chooses a triangle in proportion to its area. Integers make the choice independent of the scene's scale.
    uint place = fraction(point, 0);
    uint low = 0, high = push.lit_triangle_count - 1;
    while (low < high) {
        uint half_way = (low + high) / 2;
        if (lit_triangles[half_way].share_end > place) high = half_way; else low = half_way + 1;
    }
    uint self = lit_triangles[low].triangle;
    Triangle triangle = triangle_at(self);
    Normals corner = normals_at(self);
    // Uniform point of the triangle (Heitz 2019).
    vec2 w = vec2(coordinate(point, 1), coordinate(point, 2));
    w = w.x < w.y ? vec2(0.5 * w.x, w.y - 0.5 * w.x) : vec2(w.x - 0.5 * w.y, 0.5 * w.y);
    vec3 x = triangle.position + w.x * triangle.edge1 + w.y * triangle.edge2;
    vec3 n = normalize((1.0 - w.x - w.y) * corner.n0 + w.x * corner.n1 + w.y * corner.n2);
    float angle = 2.0 * PI * coordinate(point, 4);
    vec2 in_disc = sqrt(coordinate(point, 3)) * vec2(cos(angle), sin(angle));
    LightDisc disc = disc_at(light, x);
    vec3 s = disc_direction(disc, in_disc);

    vec3 geometric = cross(triangle.edge1, triangle.edge2);
    Object object = object_at(triangle.object);
    bool front = dot(geometric, s) >= 0.0;
    float eta = eta_of(object, front);
    uvec2 media[2];
    media_at(uvec2(0), object, front, media[0], media[1]);
    vec3 tint = vec3(1.0);
    if (DISPERSES) {
        // Light of one wavelength, by its coordinate on the spectrum.
        float wavelength = coordinate(point, 5);
        spectral_offset = wavelength - push.spectral_middle;
        uint index = uint(wavelength * float(SPECTRAL_STEPS));
        tint = float(SPECTRAL_STEPS) * (weights_below[index + 1] - weights_below[index]).rgb;
        if (is_body(object)) eta = filling(media[0]).ior / filling(media[1]).ior;
    }
    if (eta > 0.0 && !front) {
        geometric = -geometric;
        n = -n;
    }
    float cosine = dot(n, s);
    if (!(cosine > 0.0 && dot(geometric, s) > 0.0)) return;
    vec3 share = reflected_share(object, cosine, eta);
    vec3 arriving = tint * light.power * (disc_weight(disc, s) * cosine * push.area / float(push.points));
    ChainPath path;
    path.position = x;
    path.triangle = self;
    path.first_flux = 0.0;
    path.counts = 1;
    path.start_or_spectrum = uvec2(0);
    bool lit = push.can_occlude == 0;
    for (uint lobe = 0; lobe < push.lobes; lobe++) {
        if (lobe == 1 && eta == 0.0) return;
        vec3 r = outgoing_direction(s, n, lobe == 1 ? eta : 0.0);
        vec3 flux = arriving * (lobe == 1 ? 1.0 - share : share);
        if (!(dot(geometric, r) * (lobe == 1 ? -1.0 : 1.0) > 0.0)) continue;
        uint first_slot = local * targets + lobe * targets_per_lobe;
        for (uint index = 0; index < targets_per_lobe; index++) {
            bool is_mesh = index == push.receiver_count;
            PointSplat splat;
            vec3 hit;
            if (!is_mesh) {
                PlanarReceiver receiver = planar_receiver_at(index);
                float along = dot(r, receiver.normal);
                float away = dot(receiver.origin - x, receiver.normal);
                if (along >= 0.0 || away >= 0.0) continue;
                hit = x + (away / along) * r;
                if (!project_to_plane(receiver, to_texels(receiver, hit), flux, splat)) continue;
            }
            if (!lit && occluded(x, s, distance_to_light(light, x, s), self)) return;
            lit = true;
            if (is_mesh) {
                Hit nearest_ = nearest(x, r, self, OCCLUDES | IS_MESH_RECEIVER);
                if (!project_to_mesh(r, nearest_.triangle, nearest_.barycentric, flux, splat)) continue;
            } else if (push.can_occlude != 0 && occluded(x, hit - x, SHADOW_RAY_END, self)) {
                continue;
            }
            splats[first_slot + index] = splat;
        }
        if (push.max_interfaces == 1) continue;
        if (!lit && occluded(x, s, distance_to_light(light, x, s), self)) return;
        lit = true;
        path.direction = r;
        path.flux = flux;
        path.media = media[lobe];
        follow(path, point, first_slot);
    }
}
