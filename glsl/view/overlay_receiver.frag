// overlay receiver: the density of splats, and the texels of the light maps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(binding = 5) uniform sampler2D splat_counts; // in the places of the light maps
layout(location = 0) in vec2 place;
layout(location = 1) in flat uvec4 tile;
layout(location = 2) in flat uint is_planar;
layout(location = 0) out vec4 result;

#include "overlay.glsl"
#include "planar_receiver.glsl"
#include "outline.glsl"

// Colors of 1, 8, 64, 512 and 4096 splats and more.
const vec3 HEAT[5] = vec3[](vec3(0.02, 0.05, 0.5), vec3(0.0, 0.35, 0.4), vec3(0.2, 0.6, 0.05), vec3(0.9, 0.35, 0.0), vec3(0.9, 0.9, 0.8));
const float HEAT_ALPHA = 0.85;
// Colors of the levels' texels.
const vec3 LEVELS[MAX_LEVEL + 1] =
    vec3[](vec3(0.5), vec3(0.1, 0.8, 0.2), vec3(0.1, 0.5, 1.0), vec3(0.7, 0.3, 1.0), vec3(1.0, 0.3, 0.5), vec3(1.0, 0.8, 0.1));
// Smallest texel with a line around it, pixels.
const float LEAST_TEXEL = 4.0;

vec3 heat(float number) {
    float at = clamp(log2(number) / 3.0, 0.0, 4.0);
    int below = min(int(at), 3);
    return mix(HEAT[below], HEAT[below + 1], at - float(below));
}

// Coverage by the lines between texels of this width.
float grid(float width, vec2 change) {
    vec2 pixels = abs(fract(place / width - 0.5) - 0.5) * width / change;
    return line_at(min(pixels.x, pixels.y)) * clamp(width / (LEAST_TEXEL * max(change.x, change.y)) - 0.5, 0.0, 1.0);
}

void main() {
    // Before anything that differs between pixels.
    vec2 change = max(fwidth(place), vec2(1e-9));
    PlanarReceiver receiver = PlanarReceiver(vec3(0.0), tile.x, vec3(0.0), tile.y, vec3(0.0), tile.z, vec3(0.0), tile.w);
    ivec2 texel = clamp(ivec2(floor(place)), ivec2(0), ivec2(tile.zw) - 1);
    int coarsest = is_planar != 0 ? coarsest_level(receiver) : 0;
    float number = 0.0;
    int used = 0;
    for (int level = 0; level <= coarsest; level++) {
        float here = texelFetch(splat_counts, level_of(receiver, level).origin + (texel >> level), 0).x;
        number += here;
        if (here > 0.0) used = level;
    }
    vec4 color = vec4(0.0);
    if ((push.shown & SHOWS_DENSITY) != 0 && number > 0.0) color = vec4(heat(number), HEAT_ALPHA);
    if ((push.shown & SHOWS_TEXELS) != 0) {
        float finest = 0.6 * grid(1.0, change);
        color = mix(color, vec4(LEVELS[0], 1.0), finest);
        if (used > 0) color = mix(color, vec4(LEVELS[used], 1.0), grid(float(1 << used), change));
    }
    result = vec4(push.white * color.rgb, gl_FrontFacing ? color.a : 0.0);
}
