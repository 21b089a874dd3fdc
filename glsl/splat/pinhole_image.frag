// pinhole_image: irradiance at the texel's centre from a patch cluster that reflects or refracts an environment cell of
// constant radiance.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "optics.glsl"
#include "above.glsl"

layout(location = 0) in flat vec4 foot_and_size;
layout(location = 1) in flat vec4 ahead_and_sharp;
layout(location = 2) in flat vec4 east_and_sharp;
layout(location = 3) in flat vec4 up_and_shear;
layout(location = 4) in flat vec4 cosine_and_sine;
layout(location = 5) in flat vec4 radiance_and_range;
layout(location = 6) in flat vec4 normal_and_eta;
layout(location = 7) in flat float half_azimuth;
layout(location = 0) out vec4 irradiance;

// Integral of 15/16 (1 - x^2)^2 from -1 to x.
float step_at(float x) {
    float q = clamp(0.5 + 0.5 * x, 0.0, 1.0);
    return q * q * q * (10.0 + q * (6.0 * q - 15.0));
}

// Value at u of the box from -1 to 1 after the blur.
float box_at(float u, float sharp) {
    return step_at((u + 1.0) * sharp) - step_at((u - 1.0) * sharp);
}

void main() {
    vec2 d = gl_FragCoord.xy - foot_and_size.xy;
    vec3 q = vec3(d, 1.0);
    float s2 = 1.0 + dot(foot_and_size.zw, d * d);
    float inverse = inversesqrt(s2);
    float cosine = mean_above(dot(cosine_and_sine.xyz, q) * inverse, radiance_and_range.w);
    float eta = normal_and_eta.w;
    float normal_part = normal_coefficient(cosine, eta);
    float forward = dot(ahead_and_sharp.xyz, q) * inverse + normal_and_eta.x * normal_part;
    float sideward = dot(east_and_sharp.xyz, q) * inverse + normal_and_eta.y * normal_part;
    // atan(0, 0) is undefined.
    float u = atan(sideward, abs(forward) + abs(sideward) > 1e-20 ? forward : 1.0) / half_azimuth;
    float v = dot(up_and_shear.xyz, q) * inverse + normal_and_eta.z * normal_part - cosine_and_sine.w - up_and_shear.w * u;
    float seen = box_at(u, ahead_and_sharp.w) * box_at(v, east_and_sharp.w);
    // Fresnel's equations are symmetric in the two sides. The reflectance is 0 for eta = 1.
    float reflected = fresnel_dielectric(cosine, 1.0 / eta);
    bool reflects = normal_and_eta.xyz == vec3(0.0) && eta != 1.0;
    float share = reflects ? reflected : 1.0 - reflected;
    irradiance = vec4(radiance_and_range.xyz * (seen * share * cosine * inverse * inverse * inverse), 0.0);
}
