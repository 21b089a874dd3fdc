// triangle: the triangle's irradiance times the share of the texel that it covers. Sampling at texel centres would miss
// triangles between the centres, or count their flux several times.
#version 460

layout(location = 0) in flat vec4 corners01;
layout(location = 1) in flat vec2 corner2;
layout(location = 2) in flat vec3 irradiance;
layout(location = 0) out vec4 result;

// The integral over y from 0 to 1 of x, clamped to 0 to 1, along the side from a to b; negative where the side runs
// toward -y. The sum over three sides is the area within the unit square (Green's theorem).
float side_integral(vec2 a, vec2 b) {
    // Always in the same direction, so that two triangles with a common side compute the same value.
    bool forward = a.y < b.y;
    vec2 low = forward ? a : b;
    vec2 high = forward ? b : a;
    float y0 = clamp(low.y, 0.0, 1.0);
    float y1 = clamp(high.y, 0.0, 1.0);
    if (y0 >= y1) return 0.0;
    float slope = (high.x - low.x) / (high.y - low.y);
    float first = low.x + (y0 - low.y) * slope;
    float last = low.x + (y1 - low.y) * slope;
    float x0 = min(first, last);
    float x1 = max(first, last);
    float c0 = clamp(x0, 0.0, 1.0);
    float c1 = clamp(x1, 0.0, 1.0);
    // Mean of the clamped x between x0 and x1: the part within 0 to 1, and the part above 1.
    float mean = c0;
    if (x1 - x0 > 1e-6) mean = (0.5 * (c1 - c0) * (c1 + c0) + max(x1 - max(x0, 1.0), 0.0)) / (x1 - x0);
    return (forward ? y1 - y0 : y0 - y1) * mean;
}

void main() {
    vec2 origin = gl_FragCoord.xy - 0.5;
    vec2 a = corners01.xy - origin;
    vec2 b = corners01.zw - origin;
    vec2 c = corner2 - origin;
    float share = side_integral(a, b) + side_integral(b, c) + side_integral(c, a);
    result = vec4(irradiance * clamp(share, 0.0, 1.0), 0.0);
}
