// overlay chain count: as overlay count, within the bounds of the footprint, beyond which a turned quad may reach.
#version 460

layout(location = 5) in flat vec4 bounds;
layout(location = 0) out vec4 result;

void main() {
    bool is_inside = all(greaterThan(gl_FragCoord.xy, bounds.xy)) && all(lessThan(gl_FragCoord.xy, bounds.zw));
    result = vec4(is_inside ? 1.0 : 0.0);
}
