// place triangles: scales, turns and moves the triangles of an object that moves as a whole.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
// Of all such objects, at rest. `twin` is the index of the triangle in the scene's list.
TEXELS(0, resting_triangles)
TEXELS(1, resting_normals)
layout(std430, binding = 2) writeonly buffer Triangles { Triangle triangles[]; };
layout(std430, binding = 3) writeonly buffer NormalsOfTriangles { Normals normals[]; };
layout(push_constant) uniform PlacePush {
    vec3 column0; // of the rotation times the scale
    uint first;   // resting triangle of the object
    vec3 column1;
    uint count;   // of its triangles
    vec3 column2;
    float inverse_scale;
    vec3 shift;   // m
    float unused;
} push;

#include "blocks.glsl"

void main() {
    uint index = thread_index();
    if (index >= push.count) return;
    uint at = push.first + index;
    mat3 linear = mat3(push.column0, push.column1, push.column2);
    uvec4 last = TEXEL(resting_triangles, 3, at, 2);
    uint place = last.w;
    triangles[place].position = linear * floats_of(TEXEL(resting_triangles, 3, at, 0)) + push.shift;
    triangles[place].edge1 = linear * floats_of(TEXEL(resting_triangles, 3, at, 1));
    triangles[place].edge2 = linear * floats_of(last);
    normals[place].n0 = push.inverse_scale * (linear * floats_of(TEXEL(resting_normals, 3, at, 0)));
    normals[place].n1 = push.inverse_scale * (linear * floats_of(TEXEL(resting_normals, 3, at, 1)));
    normals[place].n2 = push.inverse_scale * (linear * floats_of(TEXEL(resting_normals, 3, at, 2)));
}
