// place triangles: scales, turns and moves the triangles of an object that moves as a whole.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
// Of all such objects, at rest. `twin` is the index of the triangle in the scene's list.
layout(std430, binding = 0) readonly buffer RestingTriangles { Triangle resting_triangles[]; };
layout(std430, binding = 1) readonly buffer RestingNormals { Normals resting_normals[]; };
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
    Triangle resting = resting_triangles[push.first + index];
    Normals resting_normal = resting_normals[push.first + index];
    mat3 linear = mat3(push.column0, push.column1, push.column2);
    uint place = resting.twin;
    triangles[place].position = linear * resting.position + push.shift;
    triangles[place].edge1 = linear * resting.edge1;
    triangles[place].edge2 = linear * resting.edge2;
    normals[place].n0 = push.inverse_scale * (linear * resting_normal.n0);
    normals[place].n1 = push.inverse_scale * (linear * resting_normal.n1);
    normals[place].n2 = push.inverse_scale * (linear * resting_normal.n2);
}
