// sample: divides the casters' lit triangles into patches (Wand & Strasser 2003, section 3).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
NORMALS(1)
layout(std430, binding = 2) readonly buffer LitTriangles { LitTriangle lit_triangles[]; };
layout(std430, binding = 3) writeonly buffer Patches { Patch patches[]; };
layout(push_constant) uniform SamplePush {
    uint first_patch;    // first patch of this batch
    uint patch_count;    // number of patches in total
    uint lit_triangle_count;
} push;

#include "search.glsl"
#include "triangle_lattice.glsl"

#define FIRST_PATCH(i) lit_triangles[i].first_patch

void main() {
    uint index = push.first_patch + gl_GlobalInvocationID.x;
    if (index >= push.patch_count) return;

    SEARCH(low, 0, push.lit_triangle_count, index, FIRST_PATCH)
    LitTriangle lit_triangle = lit_triangles[low];
    Triangle triangle = triangle_at(lit_triangle.triangle);
    Normals normal = normals_at(lit_triangle.triangle);

    uint n = lit_triangle.subdivision;
    ivec3 at = lattice_cell(index - lit_triangle.first_patch, n);
    float size = float(at.z) / float(n);
    vec2 middle = (vec2(at.xy) + float(at.z) / 3.0) / float(n);

    vec3 normal_du = normal.n1 - normal.n0;
    vec3 normal_dv = normal.n2 - normal.n0;
    Patch p;
    p.position = triangle.position + middle.x * triangle.edge1 + middle.y * triangle.edge2;
    p.normal = normal.n0 + middle.x * normal_du + middle.y * normal_dv;
    p.edge1 = size * triangle.edge1;
    p.edge2 = size * triangle.edge2;
    p.normal_du = size * normal_du;
    p.normal_dv = size * normal_dv;
    p.area = 0.5 * length(cross(p.edge1, p.edge2));
    p.triangle = lit_triangle.triangle;
    p.object = triangle.object;
    p.unused0 = p.unused1 = p.unused2 = 0.0;
    patches[index] = p;
}
