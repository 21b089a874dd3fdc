// Direct light of texels of rects by rays. The including shader includes planar_receiver.glsl, surface.glsl and lighting.glsl.

// Irradiance over Light.power by the ray number i of LIGHT_RAYS. Rays 4 j to 4 j + 3 are in different quarters of the texel at `place`.
float texel_ray(Light light, DiffuseSurface surface, PlanarReceiver plane, vec2 place, uint i) {
    uvec2 cell = uvec2(2 * (i & 1) + (i >> 2 & 1), (i & 2) + (i >> 3));
    uint k = cell.y * LIGHT_RAYS_SIDE + cell.x;
    vec2 within = (vec2(cell) + 0.5) / float(LIGHT_RAYS_SIDE);
    // 7 k mod 16 spreads neighbouring points over the disc.
    return ray_irradiance(light, from_texels(plane, place + within), plane.normal, surface.triangle, 7 * k % LIGHT_RAYS, LIGHT_RAYS);
}
