// Look-ups in the maps that stay inside a tile. Places and sizes are in texels.

vec3 look_up(sampler2D map, vec2 tile, vec2 size, vec2 texel) {
    vec2 low = tile + 0.5;
    return textureLod(map, clamp(texel, low, low + size - 1.0) / vec2(textureSize(map, 0)), 0.0).rgb;
}

// The cubic B-spline over 4 x 4 texels, by four bilinear look-ups (Sigg & Hadwiger 2005). It has no edges where texels are
// wide.
vec3 look_up_smooth(sampler2D map, vec2 tile, vec2 size, vec2 texel) {
    vec2 at = texel - 0.5;
    vec2 f = fract(at);
    vec2 g = 1.0 - f;
    vec2 w0 = g * g * g / 6.0;
    vec2 w1 = 2.0 / 3.0 - 0.5 * f * f * (2.0 - f);
    vec2 w3 = f * f * f / 6.0;
    vec2 left = w0 + w1;
    vec2 right = 1.0 - left;
    vec2 scale = 1.0 / vec2(textureSize(map, 0));
    vec2 low = tile + 0.5;
    vec2 high = low + size - 1.0;
    vec2 a = clamp(texel - f - 1.0 + w1 / left, low, high) * scale;
    vec2 b = clamp(texel - f + 1.0 + w3 / right, low, high) * scale;
    return left.y * (left.x * textureLod(map, a, 0.0).rgb + right.x * textureLod(map, vec2(b.x, a.y), 0.0).rgb)
        + right.y * (left.x * textureLod(map, vec2(a.x, b.y), 0.0).rgb + right.x * textureLod(map, b, 0.0).rgb);
}
