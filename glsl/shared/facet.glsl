// Facets of casters and their images on planar receivers. The including shader declares the buffers `triangles`,
// `normals`, `objects` and `lights`, and includes light.glsl, optics.glsl and planar_receiver.glsl.

// The method beams: patches of one size, each one triangle of constant irradiance without blur, lit if one ray says so.
layout(constant_id = ID_BEAMS) const bool BEAMS = false;

#include "merged.glsl"
#include "disc_part.glsl"
#include "light_part.glsl"

// The plane of a facet's triangle, oriented toward a light. Coordinates st are those of the triangle: 0 0, 1 0 and 0 1
// are its corners.
struct Surface {
    vec3 position;   // of the first corner
    vec3 edge1;
    vec3 edge2;
    vec3 normal;     // interpolated, at the first corner; toward the light
    vec3 normal_ds;
    vec3 normal_dt;
    vec3 facing;     // unit normal of the plane; toward the light
    float eta;       // see eta_of()
    uint triangle;
    Object object;
    bool is_merged;
    vec3 bulges[3];        // see bulges_of()
    vec3 normal_bulges[3]; // the same for `normal`
};

// The light, or the part of a lamp, that a facet of this triangle sees.
Light light_toward(uint light, uint triangle) {
    Triangle at = triangle_at(triangle);
    return part_seen_from(light_at(light), at.position + (at.edge1 + at.edge2) / 3.0);
}

// The surface of `index` as `light` sees it. The back of a surface that only reflects is dark: eta = 0 and the facing
// normal turned away.
Surface surface_toward(uint index, Light light) {
    Triangle triangle = triangle_at(index);
    Normals corner = normals_at(index);
    vec3 facing = cross(triangle.edge1, triangle.edge2);
    vec3 s = disc_at(light, triangle.position + (triangle.edge1 + triangle.edge2) / 3.0).direction;
    bool front = dot(facing, s) >= 0.0;
    Object object = object_at(triangle.object);
    float eta = eta_of(object, front);
    float side = eta == 0.0 || front ? 1.0 : -1.0;
    bool merged = is_merged(triangle);
    vec3 bulges[3] = bulges_of(triangle);
    vec3 normal_bulges[3] = vec3[](vec3(0.0), vec3(0.0), vec3(0.0));
    if (HAS_MERGED) {
        Normals middle = normals_at(triangle.twin);
        float scale = merged ? 4.0 * side : 0.0;
        normal_bulges[0] = scale * (middle.n0 - 0.5 * (corner.n0 + corner.n1));
        normal_bulges[1] = scale * (middle.n1 - 0.5 * (corner.n1 + corner.n2));
        normal_bulges[2] = scale * (middle.n2 - 0.5 * (corner.n2 + corner.n0));
    }
    return Surface(triangle.position, triangle.edge1, triangle.edge2, side * corner.n0, side * (corner.n1 - corner.n0),
        side * (corner.n2 - corner.n0), side * normalize(facing), eta, index, object, merged, bulges, normal_bulges);
}

vec3 position_at(Surface surface, vec2 st) {
    vec3 x = surface.position + st.x * surface.edge1 + st.y * surface.edge2;
    if (HAS_MERGED) x += bulge_at(surface.bulges, st);
    return x;
}

vec3 normal_at(Surface surface, vec2 st) {
    vec3 n = surface.normal + st.x * surface.normal_ds + st.y * surface.normal_dt;
    if (HAS_MERGED) n += bulge_at(surface.normal_bulges, st);
    return normalize(n);
}

// Area of the surface over that of the plane, where the normal is n. On a triangle of the mesh, normals say where light goes; its area is that of
// its plane.
float area_over_plane(Surface surface, vec3 n) {
    float area = 1.0;
    if (HAS_MERGED && surface.is_merged) area = 1.0 / max(dot(n, surface.facing), 0.1);
    return area;
}

// The light that leaves a point of a surface.
struct OutgoingRay {
    vec3 position;
    vec3 direction;  // unit; 0 where all light is reflected totally
    float radius;    // angular radius of the disc that is reflected; 0 where light is refracted
    vec3 irradiance_factor; // irradiance of the surface, per area of its plane, over Light.power, times the lobe's share
    float margin;    // < 0: no light of this lobe leaves the point
};

// The part of a light's disc that lights a point of the surface, where the normal is n, and whose light leaves on the side of its lobe.
DiscPart lit_part(Surface surface, Light light, LightDisc disc, vec3 n, float eta) {
    if (eta != 0.0) return part_above(disc.direction, 0.0, surface.facing, 0.0);
    // What is reflected is above the surface where what arrives is above the mirror image of its plane. Of both planes, the one that is
    // nearer to the light cuts its disc. Refracting surfaces have light on both sides.
    vec3 image = mirrored(surface.facing, n);
    bool is_nearer = surface.eta != 0.0 || dot(image, disc.direction) < dot(surface.facing, disc.direction);
    return part_above(disc.direction, radius_of(light, disc), is_nearer ? image : surface.facing, 0.0);
}

// The ray that leaves the surface at st. eta = 0: reflected light; otherwise refracted.
OutgoingRay leave(Surface surface, Light light, float eta, vec2 st) {
    OutgoingRay ray;
    ray.position = position_at(surface, st);
    vec3 n = normal_at(surface, st);
    LightDisc disc = disc_at(light, ray.position);
    DiscPart part = lit_part(surface, light, disc, n, eta);
    ray.radius = eta == 0.0 ? radius_of(light, disc) : 0.0;
    ray.direction = outgoing_direction(brightest(part, radius_of(light, disc), n), n, eta);
    float cosine = dot(n, part.direction);
    ray.margin = min(cosine, part.margin);
    if (eta != 0.0) ray.margin = min(ray.margin, -dot(ray.direction, surface.facing));
    cosine = max(cosine, 0.0);
    vec3 share = reflected_share(surface.object, cosine, surface.eta);
    ray.irradiance_factor = part.share * disc.falloff * cosine * area_over_plane(surface, n) * (eta == 0.0 ? share : 1.0 - share);
    return ray;
}

// Where a ray lands on a receiver.
struct Landing {
    vec2 texel;      // on the receiver's plane, in the light-map image; beyond reach where `margin` < 0
    float margin;    // < 0: no light of this lobe leaves the point for the receiver's front
    float distance_; // to the receiver's plane, m
    DiscPart part;   // of the disc that leaves the surface: what may land on the receiver
};

// Distance from x beyond which a point of the receiver's plane is certainly outside the receiver, m.
float reach_of(PlanarReceiver receiver, vec3 x) {
    vec3 diagonal = receiver.edge_u + receiver.edge_v;
    return distance(x, receiver.origin + 0.5 * diagonal) + length(diagonal);
}

Landing land(Surface surface, OutgoingRay ray, PlanarReceiver receiver) {
    Landing landing;
    float height = dot(ray.position - receiver.origin, receiver.normal);
    // A point on the receiver itself counts as above it, whatever the rounding.
    float slack = 1e-5 * (length(surface.edge1) + length(surface.edge2));
    // Flatter rays leave the receiver's rectangle before they meet its plane.
    float flattest = max(height, slack) / reach_of(receiver, ray.position);
    landing.part = part_above(ray.direction, ray.radius, -receiver.normal, flattest);
    float steepness = -dot(landing.part.direction, receiver.normal);
    landing.margin = min(ray.margin, min(height + slack, landing.part.margin));
    landing.distance_ = max(height, 0.0) / max(steepness, flattest);
    vec3 direction = landing.part.direction + max(flattest - steepness, 0.0) * -receiver.normal;
    landing.texel = to_texels(receiver, ray.position + landing.distance_ * direction);
    return landing;
}

#include "triangle_lattice.glsl"
