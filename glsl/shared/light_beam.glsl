// The light of a patch or a chain on mesh receivers is a beam around its central ray. The section of the beam across the ray is
// linear in the distance. A quadtree finds the squares of texels that the beam touches. The including shader declares `atlas_nodes`.

// The light of a patch or a chain. In the axes a and b across `direction`, the section at the distance s has the centre middle + s
// drift and a root of covariance (of_patch + s patch_growth, of_light + s light_growth).
struct LightBeam {
    vec3 start;
    vec3 direction;      // unit
    vec3 a;
    vec3 b;
    vec2 middle;
    vec2 drift;
    mat2 of_patch;
    mat2 patch_growth;
    mat2 of_light;
    mat2 light_growth;
    float sharpest;  // of the kernel
    float end;       // distance, m, behind which there is no light
};

// Variance of the section at the distance s in the direction u.
float variance_along(LightBeam beam, vec2 u, float s) {
    vec2 of_patch = u * (beam.of_patch + s * beam.patch_growth);
    vec2 of_light = u * (beam.of_light + s * beam.light_growth);
    return dot(of_patch, of_patch) + dot(of_light, of_light);
}

// Sum of the products of the entries.
float inner(mat2 a, mat2 b) {
    return dot(a[0], b[0]) + dot(a[1], b[1]);
}

// Relative growth of the section's width with the distance, at the distance s, 1/m.
float growth_at(LightBeam beam, float s) {
    mat2 of_patch = beam.of_patch + s * beam.patch_growth;
    mat2 of_light = beam.of_light + s * beam.light_growth;
    float variance = inner(of_patch, of_patch) + inner(of_light, of_light);
    float change = inner(of_patch, beam.patch_growth) + inner(of_light, beam.light_growth);
    return variance > 0.0 ? change / variance : 0.0;
}

// Whether light may fall on a node. False only if some line separates the beam, out to the `support` of its kernel,
// from the node's sphere. The variance is convex in s, so its ends bound it.
bool may_light(LightBeam beam, AtlasNode node, float support) {
    vec3 to_node = node.centre - beam.start;
    float s = dot(to_node, beam.direction);
    bool lit = node.radius >= 0.0 && s + node.radius > 0.0 && s - node.radius < beam.end && dot(node.axis, beam.direction) < node.sine;
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

// The nodes that touch_nodes() found.
uint touched[MESH_FOOTPRINT_SLOTS];

// Finds the nodes that a beam touches out to the `support` of its kernel, as fine as there are slots, and returns their number.
uint touch_nodes(MeshReceiver receiver, LightBeam beam, float support) {
    uint next[MESH_FOOTPRINT_SLOTS + 1];
    uint count = 1;
    touched[0] = packed(uvec3(receiver.levels, 0, 0));
    for (uint level = receiver.levels; level > 0; level--) {
        uint found = 0;
        for (uint i = 0; i < count; i++) {
            uint others = count - 1 - i;
            uvec3 node = unpacked(touched[i]);
            uint first = found;
            bool fits = node.x == level;
            for (uint child = 0; fits && child < 4; child++) {
                uvec3 place = uvec3(level - 1, 2 * node.yz + uvec2(child & 1, child >> 1));
                bool is_touched = may_light(beam, node_at(receiver, place), support);
                fits = !is_touched || found + others < MESH_FOOTPRINT_SLOTS;
                // Written whether it counts or not, as the stack in trace.glsl.
                next[found] = packed(place);
                found += uint(is_touched && fits);
            }
            if (!fits) {
                found = first;
                next[found++] = touched[i];
            }
        }
        count = found;
        for (uint i = 0; i < count; i++) touched[i] = next[i];
    }
    return count;
}
