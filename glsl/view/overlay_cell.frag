// overlay cell: the outline of a cell.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(location = 0) in vec2 place;
layout(location = 1) in flat vec3 color;
layout(location = 0) out vec4 result;

#include "overlay.glsl"
#include "outline.glsl"

void main() {
    vec2 change = max(fwidth(place), vec2(1e-9));
    vec2 pixels = (1.0 - abs(place)) / change;
    result = vec4(push.white * color, line_at(min(pixels.x, pixels.y)) * faded(1.0 / max(change.x, change.y)));
}
