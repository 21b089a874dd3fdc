// points: writes a point's flux over the texel's area.
#version 460

layout(location = 0) in flat vec3 irradiance;
layout(location = 0) out vec4 result;

void main() {
    result = vec4(irradiance, 0.0);
}
