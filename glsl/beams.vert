// beams: expands triangles into screen-aligned quads. Vertex 4 b + c is corner c of beam b.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "layout.glsl"

layout(std430, binding = 0) readonly buffer Beams { Beam beams[]; };
layout(push_constant) uniform DrawPush {
    vec2 atlas_size;  // texels
} push;
layout(location = 0) out flat vec4 corners01;
layout(location = 1) out flat vec2 corner2;
layout(location = 2) out flat vec3 irradiance;

void main() {
    Beam beam = beams[gl_VertexIndex / 4];
    corners01 = vec4(beam.corner0, beam.corner1);
    corner2 = beam.corner2;
    irradiance = beam.irradiance;
    vec2 place = mix(beam.lower, beam.upper, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1));
    gl_Position = vec4(place / push.atlas_size * 2.0 - 1.0, 0.0, 1.0);
}
