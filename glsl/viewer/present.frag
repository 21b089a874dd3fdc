// Shows linear radiance on a display: exposure, the Khronos PBR Neutral tone mapper, and the sRGB transfer function. The same as
// src/tone_map.rs and src/srgb.rs.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "pictures.glsl"

vec3 neutral(vec3 c) {
    const float f90 = 0.04;
    const float ks = 0.8 - f90;
    const float kd = 0.15;
    float x = min(c.r, min(c.g, c.b));
    c -= x < 2.0 * f90 ? x - x * x / (4.0 * f90) : f90;
    float p = max(c.r, max(c.g, c.b));
    if (p <= ks) {
        return c;
    }
    float pn = 1.0 - (1.0 - ks) * (1.0 - ks) / (p + 1.0 - 2.0 * ks);
    float g = 1.0 / (kd * (p - pn) + 1.0);
    return min(pn * (1.0 - g) + c * (pn / p * g), vec3(1.0));
}

void main() {
    vec3 seen;
    if (SHOWS_B) seen = radiance(picture_b);
    else seen = radiance(picture_a);
    vec3 shown = neutral(seen * exposure);
    if (ENCODES) shown = encode(shown);
    color = vec4(shown, 1.0);
}
