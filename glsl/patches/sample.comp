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

void main() {
    uint index = push.first_patch + gl_GlobalInvocationID.x;
    if (index >= push.patch_count) return;

    // The last lit triangle that starts at or before this patch.
    uint low = 0, high = push.lit_triangle_count - 1;
    while (low < high) {
        uint half_way = (low + high + 1) / 2;
        if (lit_triangles[half_way].first_patch <= index) low = half_way; else high = half_way - 1;
    }
    LitTriangle lit_triangle = lit_triangles[low];
    Triangle triangle = triangle_at(lit_triangle.triangle);
    Normals normal = normals_at(lit_triangle.triangle);

    // Row r of the parent triangle holds n - r upright patches and n - r - 1 inverted patches between them, 2 (n - r) -
    // 1 in total. The `left` last patches, counting from this one, therefore fill more than m - 1 and at most m = n - r
    // rows: m is the square root of `left`, rounded up.
    uint n = lit_triangle.subdivision;
    uint left = n * n - (index - lit_triangle.first_patch);
    uint m = uint(ceil(sqrt(float(left))));
    // The float is wrong by at most one for all n < 2^16.
    if ((m - 1) * (m - 1) >= left) m--; else if (m * m < left) m++;
    uint row = n - m;
    uint column = m * m - left;
    bool turned = column % 2 == 1;
    vec2 corner = vec2(column / 2, row) + (turned ? vec2(1.0) : vec2(0.0));
    float size = (turned ? -1.0 : 1.0) / float(n);
    vec2 middle = (corner + (turned ? -1.0 : 1.0) / 3.0) / float(n);

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
