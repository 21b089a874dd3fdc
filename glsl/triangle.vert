// triangle: expands triangles into screen-aligned quads. Vertex 4 i + c is corner c of the quad of triangle i.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"

layout(std430, binding = 0) readonly buffer TriangleSplats { TriangleSplat triangle_splats[]; };
layout(location = 0) out flat vec4 corners01;
layout(location = 1) out flat vec2 corner2;
layout(location = 2) out flat vec3 irradiance;

void main() {
    TriangleSplat splat = triangle_splats[gl_VertexIndex / 4];
    corners01 = vec4(splat.corner0, splat.corner1);
    corner2 = splat.corner2;
    irradiance = splat.irradiance;
    gl_Position = clip_position(quad_corner(splat.lower, splat.upper));
}
