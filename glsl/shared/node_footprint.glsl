// The footprint of a beam on one square of texels of a mesh receiver. The including shader includes kernel_fit.glsl and
// light_beam.glsl.

// Lower bound on a texel's smaller variance over the larger, for texels seen edge on.
const float MIN_VARIANCE_RATIO = 1e-3;

// Unit normal of a triangle on the side from which a ray arrives.
vec3 normal_against(Triangle triangle, vec3 direction) {
    vec3 normal = normalize(cross(triangle.edge1, triangle.edge2));
    return dot(normal, direction) > 0.0 ? -normal : normal;
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
    mat2 of_light = to_texels * (beam.of_light + s * beam.light_growth);
    Kernel kernel = kernel_for(of_patch, of_light, 1.0 / 12.0, beam.sharpest);
    if (s > beam.end || !(kernel.determinant > 0.0) || !may_light(beam, node, kernel.profile.support)) return false;

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
