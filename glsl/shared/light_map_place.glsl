// From the light-map image to the planar receivers. The including shader declares the buffer `planar_receivers` and includes
// overlay.glsl and planar_receiver.glsl.

// Where the camera sees the place `at` of the image, texels, which belongs to the level of a light map that has the texel at
// `inside`.
vec4 seen_on_receiver(vec2 at, vec2 inside) {
    for (uint index = 0; index < push.receiver_count; index++) {
        PlanarReceiver receiver = planar_receiver_at(index);
        int coarsest = coarsest_level(receiver);
        for (int level = 0; level <= coarsest; level++) {
            Level tile = level_of(receiver, level);
            vec2 low, high;
            level_bounds(tile, level, low, high);
            if (any(lessThan(inside, low)) || any(greaterThanEqual(inside, high))) continue;
            vec2 texel = vec2(receiver.tile_x, receiver.tile_y) + (at - vec2(tile.origin)) * float(1 << level);
            vec3 position = from_texels(receiver, texel);
            return dot(push.eye - position, receiver.normal) > 0.0 ? seen_over(position) : NOWHERE;
        }
    }
    return NOWHERE;
}
