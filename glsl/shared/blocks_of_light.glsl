// Classes of lights in blocks. The including shader declares the buffer `blocks` and includes surface.glsl.

// The class of a light in the block number `index`.
uint shade_of(uint index, uint light, uint light_count) {
    uint words = (light_count + LIGHTS_PER_WORD - 1) / LIGHTS_PER_WORD;
    return blocks[index * words + light / LIGHTS_PER_WORD] >> 2 * (light % LIGHTS_PER_WORD) & 3u;
}
