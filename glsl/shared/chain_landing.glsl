// Landings of chains on mesh receivers: a path's light as a beam, which a mesh receiver meets before the path's hit or with it.
//
// The including shader declares `mesh_receivers`, and includes chain.glsl and light_beam.glsl.

// Whether the path ends on the front of a mesh receiver.
bool ends_on_mesh(ChainPath path, ChainHit hit) {
    if (hit.triangle == NO_TRIANGLE) return false;
    Triangle triangle = triangle_at(hit.triangle);
    Object object = object_at(triangle.object);
    bool front = dot(cross(triangle.edge1, triangle.edge2), path.direction) < 0.0;
    return front && object.kind == DIFFUSE && object.receiver != NO_RECEIVER && object.shape == MESH;
}

// Changes of the section's centre over the spectrum: of its place, m, and of its slope.
void spectrum_of(ChainPath path, out vec2 place, out vec2 slope) {
    place = slope = vec2(0.0);
    if (DISPERSES) {
        place = unpackHalf2x16(path.start_or_spectrum.x);
        slope = unpackHalf2x16(path.start_or_spectrum.y);
    }
}

// The light of a path whose coordinate on the spectrum is `offset` beyond that of the traced light. Behind a mirror or an interface
// there is none: what passes beside its edge is that of other paths.
LightBeam beam_of(ChainPath path, ChainHit hit, float offset) {
    LightBeam beam;
    beam.start = path.position;
    beam.direction = path.direction;
    basis(path.direction, beam.a, beam.b);
    vec2 place, slope;
    spectrum_of(path, place, slope);
    beam.middle = offset * place;
    beam.drift = offset * slope;
    float deviation = sqrt(push.spread);
    beam.of_patch = deviation * mat2(path.cell_place.xy, path.cell_place.zw);
    beam.patch_growth = deviation * mat2(path.cell_direction.xy, path.cell_direction.zw);
    beam.of_light = mat2(path.light_place.xy, path.light_place.zw);
    beam.light_growth = mat2(path.light_direction.xy, path.light_direction.zw);
    beam.sharpest = SHARPEST_CURVED;
    beam.end = FAR;
    if (hit.triangle != NO_TRIANGLE && object_at(triangle_at(hit.triangle).object).kind != DIFFUSE) beam.end = hit.distance;
    return beam;
}

// The node of all texels of a receiver.
AtlasNode root_of(MeshReceiver receiver) {
    return node_at(receiver, uvec3(receiver.levels, 0, 0));
}

// Distance at which the path is on the receiver or passes it, m.
float distance_to(MeshReceiver receiver, ChainPath path, ChainHit hit) {
    if (ends_on_mesh(path, hit)) return hit.distance;
    return clamp(dot(root_of(receiver).centre - path.position, path.direction), 0.0, hit.distance);
}

// Extent of the path's band on the receiver, in standard deviations of the footprint. `finest`: spacing of the lattice over that
// of the path's.
float dispersion_on(MeshReceiver receiver, ChainPath path, ChainHit hit, float finest) {
    vec2 place, slope;
    spectrum_of(path, place, slope);
    float s = distance_to(receiver, path, hit);
    vec2 of_spectrum = place + s * slope;
    if (of_spectrum == vec2(0.0)) return 0.0;
    LightBeam beam = beam_of(path, hit, 0.0);
    beam.of_patch *= finest;
    beam.patch_growth *= finest;
    vec3 diagonal = root_of(receiver).diagonal;
    float of_texel = 0.5 * (diagonal.x + diagonal.y + diagonal.z);
    float length_ = length(of_spectrum);
    return band_of(path).y * length_ * inversesqrt(variance_along(beam, of_spectrum / length_, s) + of_texel);
}

// Parts of the band on the receiver, each no wider than the footprint's standard deviation.
uint parts_on(MeshReceiver receiver, ChainPath path, ChainHit hit) {
    if (DISPERSES) return uint(clamp(ceil(dispersion_on(receiver, path, hit, 1.0)), 1.0, MAX_PARTS));
    return 1;
}

// The middle of part number `part` of `parts` of the path's band, beyond the coordinate of the traced light.
float offset_of(ChainPath path, uint part, uint parts) {
    vec3 band = band_of(path);
    if (parts < 2 && band.y == 1.0) return 0.0;
    return band.x + (float(part) + 0.5) * band.y / float(parts) - band.z;
}

// Largest level of a node that packed() has room for.
const uint MAX_ATLAS_LEVEL = 15;

// Whether a beam touches a leaf of a receiver's quadtree.
bool touches(MeshReceiver receiver, LightBeam beam) {
    // Each level leaves at most three nodes beside the one that is next.
    uint stack[3 * MAX_ATLAS_LEVEL + 1];
    uint count = 1;
    stack[0] = packed(uvec3(receiver.levels, 0, 0));
    while (count > 0) {
        uvec3 place = unpacked(stack[--count]);
        if (!may_light(beam, node_at(receiver, place), CHAIN_SUPPORT)) continue;
        if (place.x == 0) return true;
        for (uint child = 0; child < 4; child++) {
            stack[count++] = packed(uvec3(place.x - 1, 2 * place.yz + uvec2(child & 1, child >> 1)));
        }
    }
    return false;
}

// Whether light of a path reaches a mesh receiver, before the path's hit or with it.
bool reaches_mesh(ChainPath path, ChainHit hit) {
    if (ends_on_mesh(path, hit)) return true;
    for (uint index = 0; index < push.mesh_count; index++) {
        MeshReceiver receiver = mesh_receivers[index];
        // The ends and the middle of the band stand for all of it.
        uint parts = 1;
        if (DISPERSES) parts = 3;
        for (uint part = 0; part < parts; part++) {
            if (touches(receiver, beam_of(path, hit, offset_of(path, part, parts)))) return true;
        }
    }
    return false;
}
