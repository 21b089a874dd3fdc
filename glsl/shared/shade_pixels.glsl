// Computes the listed pixels. The including shader includes shade.glsl and declares seen_in().

void main() {
    uint list = push.first.y;
    uint item = push.first.x + group_index() * SPLAT_GROUP + gl_LocalInvocationIndex;
    if (item >= counts[list]) return;
    uint packed = pixels[list == 0 ? item : push.capacity - 1 - item];
    uvec2 pixel = uvec2(packed & 0xffffu, packed >> 16);
    // One sample in the middle of a pixel that shows one triangle, and all samples of another.
    int side = list == 0 ? 1 : int(push.side);
    float spread = 2.0 * length(push.up) / push.size.y / float(side);
    Seen sum = Seen(vec3(0.0), 0.0);
    for (int i = 0; i < side * side; i++) {
        ivec2 at = ivec2(i % side, i / side);
        vec3 direction = direction_at(vec2(pixel) + (vec2(at) + 0.5) / float(side));
        uint first = texelFetch(visible, ivec2((pixel - push.tile) * push.side) + at, 0).r;
        Seen seen = seen_in(direction, first, spread);
        sum.radiance += seen.radiance;
        sum.untextured += seen.untextured;
    }
    imageStore(view, ivec2(pixel), vec4(sum.radiance / float(side * side), 1.0));
    if (list == 0) untextured[index_in_tile(ivec2(pixel))] = max(sum.untextured, LEAST_LUMINANCE);
}
