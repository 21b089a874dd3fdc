// The pictures of both sides, and how the window shows them, pixel by pixel. Where one side is shown, both are its picture.

layout(set = 0, binding = 0) uniform sampler2D picture_a;
layout(set = 0, binding = 1) uniform sampler2D picture_b;

// Constants of the pipeline and not of the draw: lavapipe runs both sides of branches.
// The side to show: B or A.
layout(constant_id = 0) const bool SHOWS_B = false;
// Whether to encode sRGB, since the target does not.
layout(constant_id = 1) const bool ENCODES = false;

layout(push_constant) uniform Push {
    // 2^exposure_ev
    float exposure;
    // Difference that the heat map's last colour stands for: W/m^2/sr, or relative.
    float scale;
    uint is_relative;
};

layout(location = 0) out vec4 color;

vec3 radiance(sampler2D picture) {
    return texelFetch(picture, ivec2(gl_FragCoord.xy), 0).rgb;
}

vec3 encode(vec3 linear) {
    vec3 x = clamp(linear, 0.0, 1.0);
    return mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}

vec3 decode(vec3 srgb) {
    return mix(pow((srgb + 0.055) / 1.055, vec3(2.4)), srgb / 12.92, lessThanEqual(srgb, vec3(0.04045)));
}
