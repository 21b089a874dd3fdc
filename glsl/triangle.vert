// beams: expands triangles into screen-aligned quads. Vertex 4 b + c is corner c of beam b.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(std430, binding = 0) readonly buffer TriangleSplats { TriangleSplat triangle_splats[]; };
layout(push_constant) uniform DrawPush {
    vec2 atlas_size;  // texels
} push;
layout(location = 0) out flat vec4 corners01;
layout(location = 1) out flat vec2 corner2;
layout(location = 2) out flat vec3 irradiance;

void main() {
    TriangleSplat splat = triangle_splats[gl_VertexIndex / 4];
    corners01 = vec4(splat.corner0, splat.corner1);
    corner2 = splat.corner2;
    irradiance = splat.irradiance;
    vec2 place = mix(splat.lower, splat.upper, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1));
    gl_Position = vec4(place / push.atlas_size * 2.0 - 1.0, 0.0, 1.0);
}
