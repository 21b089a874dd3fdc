// pinhole_image: expands pinhole images into screen-aligned quads. Vertex 4 i + c is corner c of image i.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"

layout(std430, binding = 0) readonly buffer PinholeImages { PinholeImage pinhole_images[]; };
layout(location = 0) out flat vec4 foot_and_size;
layout(location = 1) out flat vec4 ahead_and_sharp;
layout(location = 2) out flat vec4 east_and_sharp;
layout(location = 3) out flat vec4 up_and_shear;
layout(location = 4) out flat vec4 cosine_and_sine;
layout(location = 5) out flat vec4 radiance_and_range;
layout(location = 6) out flat vec4 normal_and_eta;
layout(location = 7) out flat float half_azimuth;

void main() {
    PinholeImage image = pinhole_images[gl_VertexIndex / 4];
    vec2 shear_range = unpackHalf2x16(image.shear_range);
    half_azimuth = image.half_azimuth;
    foot_and_size = vec4(image.foot, image.size);
    ahead_and_sharp = vec4(image.ahead, image.sharp_azimuth);
    east_and_sharp = vec4(image.east, image.sharp_sine);
    up_and_shear = vec4(image.up, shear_range.x);
    cosine_and_sine = vec4(image.cosine, image.sine);
    radiance_and_range = vec4(image.radiance, shear_range.y);
    normal_and_eta = vec4(image.normal, image.eta);
    gl_Position = clip_position(quad_corner(image.lower, image.upper));
}
