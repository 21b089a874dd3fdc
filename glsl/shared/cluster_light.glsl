// The light that a patch cluster sends from an environment cell to a planar receiver. A cluster's normals, and a cell's
// directions, may lie on both sides of a horizon: that of the surface, or that of the receiver. The cluster then sends a
// share of its flux. The including shader includes trace.glsl, cluster.glsl and their includes, and declares
// CLUSTER_STARTS_OF.

// Lower bound on the cosine at the receiver.
const float GRAZING = 0.01;

// Weight of light that passes by the receiver's rectangle, when a ray is chosen.
const float BESIDE = 0.02;

// An environment cell in the axes of its centre.
struct Cell {
    vec3 ahead;
    vec3 east;
    float half_azimuth;
    float half_sine;
    float sine;
};

Cell cell_of(Light light) {
    vec3 ahead = normalize(vec3(light.place.x, 0.0, light.place.z));
    return Cell(ahead, vec3(-ahead.z, 0.0, ahead.x), light.half_azimuth, light.half_sine, light.place.y);
}

// The direction at uv; the cell is -1 to 1 on both axes.
vec3 toward(Cell cell, vec2 uv) {
    float azimuth = uv.x * cell.half_azimuth;
    float sine = clamp(cell.sine + uv.y * cell.half_sine, -1.0, 1.0);
    float level = sqrt(1.0 - sine * sine);
    return level * (cos(azimuth) * cell.ahead + sin(azimuth) * cell.east) + vec3(0.0, sine, 0.0);
}

// What a cluster sends from a cell to a receiver. Means are weighted by flux.
struct OutgoingLight {
    vec3 toward;     // mean direction toward the light, unit
    vec3 direction;  // mean outgoing direction, unit
    vec3 ray;        // one direction toward the light, unit, drawn from those whose light meets the receiver
    vec3 cosine;     // mean of cosine, share that goes to the receiver and Fresnel factor
    mat3 covariance; // of the outgoing directions, by the light's directions
};

// Light from `cell` in nine parts; `u`, in 0 to 1, chooses the ray. Returns false where there is none.
bool outgoing_light(Patch patch_, Cell cell, float eta, bool refracts, PlanarReceiver receiver, float u, out OutgoingLight outgoing) {
    vec3 m = receiver.normal;
    float height = dot(patch_.position - receiver.origin, m);
    vec2 origin = vec2(receiver.tile_x, receiver.tile_y);
    float lobe_eta = refracts ? eta : 0.0;
    Object object = object_at(patch_.object);
    vec3 n = normalize(patch_.normal);
    NormalChange normal_change = normal_change_of(patch_);
    outgoing = OutgoingLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0), mat3(0.0));
    float total = 0.0;
    float landing = 0.0;
    for (int i = 0; i < 9; i++) {
        vec3 s = toward(cell, 2.0 / 3.0 * vec2(i % 3 - 1, i / 3 - 1));
        float cosine = dot(s, n);
        // Refracted light fades toward the horizon by itself.
        float range = refracts ? 0.0 : range_along(normal_change, n, s);
        float facing = mean_above(cosine, range);
        if (facing <= 0.0) continue;
        // The mean normal of the part that faces the light.
        vec3 facing_normal = cosine < range ? normalize(n + (s - cosine * n) * (0.5 * (range - cosine))) : n;
        vec3 r = outgoing_direction(s, facing_normal, lobe_eta);
        if (r == vec3(0.0)) continue;
        float descent = -dot(r, m);
        float descent_range = range_along(normal_change, n, normal_gradient(s, facing_normal, m, lobe_eta));
        float weight = facing * share_above(descent, descent_range);
        if (weight <= 0.0) continue;
        if (descent < descent_range) r -= (0.5 * (descent_range - descent)) * m;
        total += weight;
        // Chooses a direction with a probability in proportion to the light that it sends onto the receiver's rectangle.
        vec2 place = to_texels(receiver, patch_.position - r * (height / min(dot(r, m), -1e-4)));
        bool lands = place == clamp(place, origin, origin + vec2(receiver.width, receiver.height));
        float chance = lands ? weight : BESIDE * weight;
        landing += chance;
        bool chosen = u * landing < chance;
        u = chosen ? u * landing / chance : (u * landing - chance) / (landing - chance);
        if (chosen) outgoing.ray = s;
        vec3 reflected = reflected_share(object, facing, eta);
        outgoing.cosine += weight / 9.0 * (refracts ? 1.0 - reflected : reflected);
        outgoing.toward += weight * s;
        outgoing.direction += weight * r;
        outgoing.covariance += weight * outerProduct(r, r);
    }
    if (total <= 0.0) return false;
    outgoing.toward = normalize(outgoing.toward);
    outgoing.direction /= total;
    outgoing.covariance = outgoing.covariance / total - outerProduct(outgoing.direction, outgoing.direction);
    outgoing.direction = normalize(outgoing.direction);
    return true;
}

// Two numbers between 0 and 1 that are evenly distributed over the cells of a cluster, and over the clusters of a cell
// (Roberts 2018).
vec2 pair_point(uvec2 pair) {
    return fract(vec2(pair.y) * vec2(0.7548776662, 0.5698402910) + vec2(pair.x) * vec2(0.6180339887, 0.3819660113) + 0.5);
}

// Whether the light that a cluster sends to a receiver arrives. Tested from one place of the cluster with the normal there,
// which `u` of 0 to 1 draws by flux from those that face light and receiver: outgoing_light() has left out the others. `eta` is
// 0 for reflected light, `side` is -1 where the patch was turned.
bool arrives(uint index, float side, vec3 ray, float eta, PlanarReceiver receiver, float u) {
    vec3 m = receiver.normal;
    float total = 0.0;
    ClusterStart start;
    vec3 r;
    for (uint i = 0; i < CLUSTER_STARTS; i++) {
        ClusterStart other = cluster_start_at(index * CLUSTER_STARTS + i);
        vec3 n = side * other.normal;
        float cosine = dot(n, ray);
        if (cosine <= 0.0) continue;
        vec3 outgoing = outgoing_direction(ray, n, eta);
        if (dot(outgoing, m) >= -1e-4) continue;
        total += cosine;
        bool chosen = u * total < cosine;
        u = chosen ? u * total / cosine : (u * total - cosine) / (total - cosine);
        if (chosen) {
            start = other;
            r = outgoing;
        }
    }
    if (total == 0.0) return false;
    // The part of a cluster behind the receiver sends no light.
    float height = dot(start.position - receiver.origin, m);
    if (height <= 0.0) return false;
    // Interpolated normals that differ from the triangle's send light into the surface, where it is lost.
    vec3 facet = side * cross(triangle_at(start.triangle).edge1, triangle_at(start.triangle).edge2);
    if (dot(facet, ray) <= 0.0 || dot(facet, r) > 0.0 != (eta == 0.0)) return false;
    if (push.can_occlude == 0) return true;
    vec2 target = to_texels(receiver, start.position - r * (height / dot(r, m)));
    vec2 origin = vec2(receiver.tile_x, receiver.tile_y);
    target = clamp(target, origin, origin + vec2(receiver.width, receiver.height));
    vec3 off = from_texels(receiver, target) - start.position;
    return !occluded(start.position, ray, FAR, start.triangle) && !occluded(start.position, off, SHADOW_RAY_END, start.triangle);
}
