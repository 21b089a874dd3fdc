// Curved receivers: where on its light map a point of a mesh is.

// Where on the light map, from its top left corner in texels, a point of a triangle is.
vec2 light_map_position(MeshReceiver mesh_receivers, Normals corner, vec2 weights) {
    vec2 uv0 = unpackUnorm2x16(corner.uv0);
    vec2 uv = uv0 + weights.x * (unpackUnorm2x16(corner.uv1) - uv0) + weights.y * (unpackUnorm2x16(corner.uv2) - uv0);
    return vec2(uv.x, 1.0 - uv.y) * vec2(mesh_receivers.width, mesh_receivers.height);
}
