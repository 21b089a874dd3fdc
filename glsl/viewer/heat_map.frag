// The difference of both sides' pictures in false colour.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "constants.glsl"
#include "pictures.glsl"
#include "difference.glsl"

vec3 stop(uint index) {
    return unpackUnorm4x8(HEAT_COLORS[index]).bgr;
}

void main() {
    uint last = HEAT_COLORS.length() - 1;
    float place = clamp(difference(radiance(picture_a), radiance(picture_b), is_relative != 0) / scale, 0.0, 1.0) * float(last);
    uint below = min(uint(place), last - 1);
    vec3 shown = mix(stop(below), stop(below + 1), place - float(below));
    if (ENCODES) color = vec4(shown, 1.0);
    else color = vec4(decode(shown), 1.0);
}
