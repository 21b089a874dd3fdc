// Mesh footprints: kernels on mesh receivers. The light of a patch is a beam around its central ray. The section of the
// beam across the ray is linear in the distance. A footprint is the part of the beam that meets one square of texels. The
// squares come from a quadtree, which is refined where the beam touches it as long as slots are free. The including
// shader includes trace.glsl and kernel_fit.glsl, and declares the receivers' buffers and `mesh_footprints`.

// Squared support radius of the sharpest kernel.
const float MAX_SUPPORT = 2.0 * (SHARPEST + 2.0);
// Lower bound on a texel's smaller variance over the larger, for texels seen edge on.
const float MIN_VARIANCE_RATIO = 1e-3;

// Root of the covariance of the light's directions across the ray.
mat2 light_growth(Light light, LightDisc disc, vec3 n, float eta, mat2x3 across) {
    vec3 a, b;
    light_axes(light, disc, a, b);
    a = outgoing_change(disc.direction, n, a, vec3(0.0), eta);
    b = outgoing_change(disc.direction, n, b, vec3(0.0), eta);
    return mat2(a * across, b * across);
}

// The light of a patch. In the axes a and b across `direction`, the section at the distance s has the centre middle + s
// drift and a root of covariance (of_patch + s patch_growth, s light_growth).
struct LightBeam {
    vec3 start;
    vec3 direction;      // unit
    vec3 a;
    vec3 b;
    vec2 middle;
    vec2 drift;
    mat2 of_patch;
    mat2 patch_growth;
    mat2 light_growth;
    float sharpest;  // of the kernel
};

// Variance of the section at the distance s in the direction u.
float variance_along(LightBeam beam, vec2 u, float s) {
    vec2 of_patch = u * (beam.of_patch + s * beam.patch_growth);
    vec2 of_light = u * (s * beam.light_growth);
    return dot(of_patch, of_patch) + dot(of_light, of_light);
}

// Sum of the products of the entries.
float inner(mat2 a, mat2 b) {
    return dot(a[0], b[0]) + dot(a[1], b[1]);
}

// Relative growth of the section's width with the distance, at the distance s, 1/m.
float growth_at(LightBeam beam, float s) {
    mat2 of_patch = beam.of_patch + s * beam.patch_growth;
    mat2 of_light = s * beam.light_growth;
    float variance = inner(of_patch, of_patch) + inner(of_light, of_light);
    float change = inner(of_patch, beam.patch_growth) + inner(of_light, beam.light_growth);
    return variance > 0.0 ? change / variance : 0.0;
}

// Whether light may fall on a node. False only if some line separates the beam, out to the `support` of its kernel,
// from the node's sphere. The variance is convex in s, so its ends bound it.
bool may_light(LightBeam beam, AtlasNode node, float support) {
    vec3 to_node = node.centre - beam.start;
    float s = dot(to_node, beam.direction);
    bool lit = node.radius >= 0.0 && s + node.radius > 0.0 && dot(node.axis, beam.direction) < node.sine;
    if (!lit) return false;
    vec2 off = to_node * mat2x3(beam.a, beam.b) - beam.middle - s * beam.drift;
    float distance_ = length(off);
    if (distance_ <= node.radius) return true;
    vec2 u = off / distance_;
    float nearer = variance_along(beam, u, max(s - node.radius, 0.0));
    float farther = variance_along(beam, u, s + node.radius);
    float reach = sqrt(support * (max(nearer, farther) + node.max_trace));
    return distance_ <= reach + node.radius * (1.0 + length(beam.drift));
}

// Unpacks a node of the quadtree: level | x << 4 | y << 18.
uvec3 unpacked(uint node) {
    return uvec3(node & 15u, node >> 4 & 0x3fffu, node >> 18);
}

uint packed(uvec3 node) {
    return node.x | node.y << 4 | node.z << 18;
}

AtlasNode node_at(MeshReceiver receiver, uvec3 node) {
    uint first = receiver.first_node;
    for (uint level = 0; level < node.x; level++) first += 1u << 2 * (receiver.levels - level);
    return atlas_nodes[first + (node.z << receiver.levels - node.x) + node.y];
}

// The footprint on one node. Returns false where the beam misses the node.
bool project_to_node(MeshReceiver receiver, uvec3 place, LightBeam beam, vec3 flux, vec3 occluder, vec3 occluder_normal, out MeshFootprint footprint) {
    AtlasNode node = node_at(receiver, place);
    float s = max(dot(node.centre - beam.start, beam.direction), 0.0);
    // Coordinates across the ray in which the texels' covariance is that of unit squares, I/12.
    vec3 ca = vec3(dot(vec3(node.diagonal.x, node.off_diagonal.xy), beam.a),
        dot(vec3(node.off_diagonal.x, node.diagonal.y, node.off_diagonal.z), beam.a),
        dot(vec3(node.off_diagonal.yz, node.diagonal.z), beam.a));
    vec3 cb = vec3(dot(vec3(node.diagonal.x, node.off_diagonal.xy), beam.b),
        dot(vec3(node.off_diagonal.x, node.diagonal.y, node.off_diagonal.z), beam.b),
        dot(vec3(node.off_diagonal.yz, node.diagonal.z), beam.b));
    float aa = 12.0 * dot(beam.a, ca);
    float ab = 12.0 * dot(beam.a, cb);
    float bb = 12.0 * dot(beam.b, cb);
    float min_variance = MIN_VARIANCE_RATIO * (aa + bb);
    float root_a = sqrt(aa + min_variance);
    float root_ab = ab / root_a;
    float root_b = sqrt(max(bb + min_variance - root_ab * root_ab, min_variance));
    mat2 to_texels = mat2(1.0 / root_a, -root_ab / (root_a * root_b), 0.0, 1.0 / root_b);
    mat2 of_patch = to_texels * (beam.of_patch + s * beam.patch_growth);
    mat2 of_light = to_texels * (s * beam.light_growth);
    Kernel kernel = kernel_for(of_patch, of_light, 1.0 / 12.0, beam.sharpest);
    if (!(kernel.determinant > 0.0) || !may_light(beam, node, kernel.profile.support)) return false;

    vec2 middle = beam.middle + s * beam.drift;
    uvec2 size = uvec2(LEAF << place.x);
    uvec2 tile = uvec2(receiver.tile_x, receiver.tile_y);
    uvec2 low = tile + place.yz * size;
    uvec2 high = min(low + size, tile + uvec2(receiver.width, receiver.height));
    footprint.centre = beam.start + s * beam.direction + middle.x * beam.a + middle.y * beam.b;
    footprint.flatness = kernel.profile.flatness;
    footprint.u = beam.a / root_a;
    footprint.v = (beam.b - root_ab * footprint.u) / root_b;
    footprint.travelled = s;
    footprint.low = low.x | low.y << 16;
    footprint.high = high.x | high.y << 16;
    footprint.direction = beam.direction;
    footprint.conic = conic_of(kernel);
    footprint.tolerance = 0.5 * sqrt(6.0 * node.max_trace);
    footprint.peak = flux * (peak_of(kernel) / (root_a * root_b));
    footprint.base = int(receiver.first_texel) - int(tile.x) - int(tile.y * receiver.width);
    footprint.stride = int(receiver.width);
    footprint.occluder = occluder;
    footprint.occluder_normal = occluder_normal;
    footprint.growth = growth_at(beam, s);
    return true;
}

// Writes the footprints of a beam with `flux`, W, from `slot` on, and returns their number.
uint project_to_mesh(MeshReceiver receiver, LightBeam beam, vec3 flux, vec3 occluder, vec3 occluder_normal, uint slot) {
    uint now[MESH_FOOTPRINT_SLOTS];
    uint next[MESH_FOOTPRINT_SLOTS];
    uint count = 1;
    now[0] = packed(uvec3(receiver.levels, 0, 0));
    for (uint level = receiver.levels; level > 0; level--) {
        uint found = 0;
        for (uint i = 0; i < count; i++) {
            uint others = count - 1 - i;
            uvec3 node = unpacked(now[i]);
            uint first = found;
            bool fits = node.x == level;
            for (uint child = 0; fits && child < 4; child++) {
                uvec3 place = uvec3(level - 1, 2 * node.yz + uvec2(child & 1, child >> 1));
                if (!may_light(beam, node_at(receiver, place), MAX_SUPPORT)) continue;
                fits = found + others < MESH_FOOTPRINT_SLOTS;
                if (fits) next[found++] = packed(place);
            }
            if (!fits) {
                found = first;
                next[found++] = now[i];
            }
        }
        count = found;
        for (uint i = 0; i < count; i++) now[i] = next[i];
    }
    uint written = 0;
    for (uint i = 0; i < count; i++) {
        MeshFootprint footprint;
        if (project_to_node(receiver, unpacked(now[i]), beam, flux, occluder, occluder_normal, footprint)) mesh_footprints[slot + written++] = footprint;
    }
    return written;
}

// Writes the footprints of a beam with `flux`, W, on all mesh receivers from `slot` on, and returns their number.
uint project_beam(LightBeam beam, vec3 flux, uint triangle, uint slot) {
    vec3 at = vec3(0.0);
    vec3 occluder_normal = vec3(0.0);
    if (push.can_occlude != 0) {
        Hit occluder = nearest(beam.start, beam.direction, triangle, OCCLUDES);
        if (occluder.triangle != NO_TRIANGLE) {
            at = beam.start + occluder.distance * beam.direction;
            occluder_normal = normalize(cross(triangle_at(occluder.triangle).edge1, triangle_at(occluder.triangle).edge2));
            if (dot(occluder_normal, beam.direction) > 0.0) occluder_normal = -occluder_normal;
        }
    }
    uint count = 0;
    for (uint index = 0; index < push.receiver_count; index++) {
        count += project_to_mesh(mesh_receivers[index], beam, flux, at, occluder_normal, slot + count);
    }
    return count;
}
