// Textures of diffuse surfaces. The including shader declares TEXTURE_LEVELS and TEXTURES.

// Whether the scene has textures. The compiler removes code that the scene does not need.
layout(constant_id = ID_HAS_TEXTURES) const bool HAS_TEXTURES = true;

// Maximum number of samples along a footprint's longer axis.
const int MAX_PROBES = 4;

// Linear colour of a texel.
vec3 colour_of_texel(uint texel) {
    const uint most = (1u << ROOT_BITS) - 1u;
    const uint most_blue = (1u << 32u - 2u * ROOT_BITS) - 1u;
    vec3 root = vec3(texel & most, texel >> ROOT_BITS & most, texel >> 2u * ROOT_BITS) / vec3(most, most, most_blue);
    return root * root;
}

// Mean colour of a texture: that of its last level, a single texel. `first` and `count` are its levels.
vec3 mean_colour(uint first, uint count) {
    return colour_of_texel(textures[texture_level_at(first + count - 1).first]);
}

// Colour of a level at a place in repeats of the image, v upward, bilinear. Not by a sampler, because that of lavapipe decodes sRGB
// slowly, with polynomials for every texel.
vec3 colour_of_level(uint index, vec2 uv) {
    TextureLevel level = texture_level_at(index);
    vec2 at = fract(vec2(uv.x, -uv.y)) * vec2(level.size) - 0.5;
    vec2 share = fract(at);
    uvec2 high = uvec2(ivec2(floor(at)) + 1);
    // The image repeats.
    uvec2 low = mix(high, level.size, equal(high, uvec2(0))) - 1u;
    high = mix(high, uvec2(0), greaterThanEqual(high, level.size));
    uint below = level.first + low.y * level.size.x;
    uint above = level.first + high.y * level.size.x;
    return mix(mix(colour_of_texel(textures[below + low.x]), colour_of_texel(textures[below + high.x]), share.x),
        mix(colour_of_texel(textures[above + low.x]), colour_of_texel(textures[above + high.x]), share.x), share.y);
}

// Approximates the linear mean of a texture over the parallelogram with the sides `across` and `up` around uv by samples along
// the longer side, from a level as fine as the shorter side (McCormack et al. 1999). `first` and `count` are its levels.
vec3 colour_of_texture(uint first, uint count, vec2 uv, vec2 across, vec2 up) {
    vec2 size = vec2(texture_level_at(first).size);
    float a = length(across * size);
    float b = length(up * size);
    float longer = max(a, b);
    float shorter = max(min(a, b), 1e-6);
    int probes = int(clamp(ceil(longer / max(shorter, 1.0)), 1.0, float(MAX_PROBES)));
    float level = clamp(log2(max(shorter, longer / float(probes))), 0.0, float(count - 1));
    uint low = uint(level);
    float share = level - float(low);
    vec2 step_ = (a > b ? across : up) / float(probes);
    vec2 start = uv - 0.5 * float(probes - 1) * step_;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < probes; i++) {
        vec2 place = start + float(i) * step_;
        vec3 colour = colour_of_level(first + low, place);
        if (share > 0.0) colour = mix(colour, colour_of_level(first + low + 1, place), share);
        sum += colour;
    }
    return sum / float(probes);
}
