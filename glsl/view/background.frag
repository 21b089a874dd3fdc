// background: suns and environment where no object is.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

LIGHTS(0)
layout(binding = 1) uniform sampler2D environment;
layout(location = 0) out vec4 result;

// Without an environment the image is black.
const bool HAS_ENVIRONMENT = true;

#include "camera.glsl"
#include "environment.glsl"
#include "background.glsl"

void main() {
    vec2 p = (push.tile + gl_FragCoord.xy) / push.size * 2.0 - 1.0;
    vec3 direction = normalize(push.forward + p.x * push.right - p.y * push.up);
    result = vec4(background(direction, push.rotation, push.light_count), 1.0);
}
