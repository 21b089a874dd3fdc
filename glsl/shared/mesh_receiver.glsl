// Mesh receivers: from points of the surface to the light map.

// Position of a triangle's point on the light map, in texels from the top left corner.
vec2 light_map_position(MeshReceiver mesh_receivers, Normals corner, vec2 weights) {
    vec2 uv0 = unpackUnorm2x16(corner.uv0);
    vec2 uv = uv0 + weights.x * (unpackUnorm2x16(corner.uv1) - uv0) + weights.y * (unpackUnorm2x16(corner.uv2) - uv0);
    return vec2(uv.x, 1.0 - uv.y) * vec2(mesh_receivers.width, mesh_receivers.height);
}
