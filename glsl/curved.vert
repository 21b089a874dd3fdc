// curved: expands spots into screen-aligned quads. Vertex 4 i + c is corner c of spot i.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout.glsl"

layout(std430, binding = 0) readonly buffer Spots { Spot spots[]; };
layout(push_constant) uniform DrawPush {
    vec2 atlas_size;  // texels
} push;
layout(location = 0) out flat vec4 centre_and_flatness;
layout(location = 1) out flat vec4 u_and_before;
layout(location = 2) out flat vec3 v;
layout(location = 3) out flat vec4 along_and_growth;
layout(location = 4) out flat vec4 conic_and_tolerance;
layout(location = 5) out flat vec3 peak;
layout(location = 6) out flat vec3 hit;
layout(location = 7) out flat vec3 front;
layout(location = 8) out flat ivec2 base_and_stride;

void main() {
    Spot spot = spots[gl_VertexIndex / 4];
    vec2 low = vec2(spot.low & 0xffffu, spot.low >> 16);
    vec2 high = vec2(spot.high & 0xffffu, spot.high >> 16);
    vec2 corner = mix(low, high, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1));
    centre_and_flatness = vec4(spot.centre, spot.flatness);
    u_and_before = vec4(spot.u, spot.before);
    v = spot.v;
    along_and_growth = vec4(spot.along, spot.growth);
    conic_and_tolerance = vec4(spot.conic, spot.tolerance);
    peak = spot.peak;
    hit = spot.hit;
    front = spot.front;
    base_and_stride = ivec2(spot.base, spot.stride);
    gl_Position = vec4(corner / push.atlas_size * 2.0 - 1.0, 0.0, 1.0);
}
