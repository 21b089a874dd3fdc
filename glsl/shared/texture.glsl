// Textures of diffuse surfaces. The including shader declares TEXTURE_LEVELS and the sampler `textures`.

// Whether the scene has textures. The compiler removes code that the scene does not need.
layout(constant_id = ID_HAS_TEXTURES) const bool HAS_TEXTURES = true;

// Maximum number of samples along a footprint's longer axis.
const int MAX_PROBES = 4;

// Mean colour of a texture: that of its last level, a single texel. `first` and `count` are its levels.
vec3 mean_colour(uint first, uint count) {
    return texelFetch(textures, ivec2(texture_level_at(first + count - 1).origin), 0).rgb;
}

// Colour of a level at a place in repeats of the image, v upward, bilinear. Around its tile, the image continues, repeated.
// `texel` is the size of a texel of the image of all textures over its sides.
vec3 colour_of_level(TextureLevel level, vec2 uv, vec2 texel) {
    vec2 at = vec2(level.origin) + fract(vec2(uv.x, -uv.y)) * vec2(level.size);
    return textureLod(textures, texel * at, 0.0).rgb;
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
    uint fine = uint(level);
    float share = level - float(fine);
    TextureLevel finer = texture_level_at(first + fine);
    TextureLevel coarser = texture_level_at(first + min(fine + 1, count - 1));
    vec2 texel = 1.0 / vec2(textureSize(textures, 0));
    vec2 step_ = (a > b ? across : up) / float(probes);
    vec2 start = uv - 0.5 * float(probes - 1) * step_;
    vec3 sum = vec3(0.0);
    for (int i = 0; i < probes; i++) {
        vec2 place = start + float(i) * step_;
        sum += mix(colour_of_level(finer, place, texel), colour_of_level(coarser, place, texel), share);
    }
    return sum / float(probes);
}
