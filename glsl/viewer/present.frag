// Shows linear radiance on a display: exposure, the Khronos PBR Neutral tone mapper, and the sRGB transfer function. The same as
// src/tone_map.rs and src/srgb.rs.
#version 460

layout(set = 0, binding = 0) uniform sampler2D picture;

layout(push_constant) uniform Push {
    // Pixels of the window.
    vec2 size;
    // 2^exposure_ev
    float exposure;
    // 1 where the target does not encode sRGB itself.
    uint encodes;
};

layout(location = 0) out vec4 color;

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

vec3 encode(vec3 linear) {
    vec3 x = clamp(linear, 0.0, 1.0);
    return mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}

void main() {
    // A picture of the window's size is not filtered: its pixels are shown as they are.
    vec3 radiance = vec2(textureSize(picture, 0)) == size
        ? texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb
        : textureLod(picture, gl_FragCoord.xy / size, 0.0).rgb;
    vec3 shown = neutral(radiance * exposure);
    color = vec4(encodes != 0 ? encode(shown) : shown, 1.0);
}
