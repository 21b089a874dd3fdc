// Diffuse surfaces: where their direct light is.

// The rect of a surface, whose texels are those of the direct map.
PlanarReceiver plane_of(DiffuseSurface surface) {
    return PlanarReceiver(
        surface.origin, surface.tile_x, surface.edge_u, surface.tile_y, surface.edge_v, surface.width, surface.normal, surface.height);
}

// Blocks across and down of a rect.
uvec2 block_counts(DiffuseSurface surface) {
    return (uvec2(surface.width, surface.height) + BLOCK - 1) / BLOCK;
}

// Column and row of a block, counted in blocks.
uvec2 place_of_block(DiffuseSurface surface, uint index) {
    uint local = index - surface.first_block;
    uint across = block_counts(surface).x;
    return uvec2(local % across, local / across);
}

// Column and row of the texel `number` of a block, in the surface's tile.
uvec2 texel_of_block(DiffuseSurface surface, uint index, uint number) {
    return place_of_block(surface, index) * BLOCK + uvec2(number % BLOCK, number / BLOCK);
}

// Size of a rect's tile of the direct map of the environment.
vec2 environment_size(DiffuseSurface surface) {
    return vec2((uvec2(surface.width, surface.height) + surface.environment_scale - 1) / surface.environment_scale);
}

// The point on the smooth surface that a triangle approximates: x is projected onto each corner's tangent plane where
// it lies below the plane, and the results are interpolated (Hanika 2021, "Hacking the Shadow Terminator"). Rays that
// start there do not meet the triangle's neighbours where the interpolated normal faces the light.
vec3 on_smooth_surface(Triangle triangle, Normals corner, vec3 x, vec2 weights) {
    vec3 from = x - triangle.position;
    return x
        - (1.0 - weights.x - weights.y) * min(dot(from, corner.n0), 0.0) * corner.n0
        - weights.x * min(dot(from - triangle.edge1, corner.n1), 0.0) * corner.n1
        - weights.y * min(dot(from - triangle.edge2, corner.n2), 0.0) * corner.n2;
}
