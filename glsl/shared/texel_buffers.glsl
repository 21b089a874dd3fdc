// Buffers of structs that shaders only read, as texel buffers of four words a texel: lavapipe fetches a texel several times
// as fast as four words of a storage buffer. NAME(slot) declares the buffer at a binding and the function that reads a struct.
// Some devices (SwiftShader) have texel buffers of 65536 texels only. build.rs compiles every shader for them, too, with the
// same words in storage buffers.

vec3 floats_of(uvec4 texel) {
    return uintBitsToFloat(texel.xyz);
}

float last_of(uvec4 texel) {
    return uintBitsToFloat(texel.w);
}

// TEXELS declares a buffer, TEXEL reads texel `part` of the struct `index` of `size` texels.
#ifdef WITHOUT_TEXEL_BUFFERS
#define TEXELS(slot, name) layout(std430, binding = slot) readonly buffer name##_block { uvec4 name[]; };
#define TEXEL(buffer_, size, index, part) buffer_[(size) * (index) + (part)]
#else
#define TEXELS(slot, name) layout(binding = slot) uniform usamplerBuffer name;
#define TEXEL(buffer_, size, index, part) texelFetch(buffer_, int((size) * (index) + (part)))
#endif

#define TRIANGLES(slot)                                                                    \
    TEXELS(slot, triangles)                                                                \
    Triangle triangle_at(uint index) {                                                     \
        uvec4 a = TEXEL(triangles, 3, index, 0);                                           \
        uvec4 b = TEXEL(triangles, 3, index, 1);                                           \
        uvec4 c = TEXEL(triangles, 3, index, 2);                                           \
        return Triangle(floats_of(a), a.w, floats_of(b), b.w, floats_of(c), c.w);          \
    }

#define NORMALS(slot)                                                                      \
    TEXELS(slot, normals)                                                                  \
    Normals normals_at(uint index) {                                                       \
        uvec4 a = TEXEL(normals, 3, index, 0);                                             \
        uvec4 b = TEXEL(normals, 3, index, 1);                                             \
        uvec4 c = TEXEL(normals, 3, index, 2);                                             \
        return Normals(floats_of(a), a.w, floats_of(b), b.w, floats_of(c), c.w);           \
    }

// The hierarchy: its grid, then its nodes.
#define NODES(slot)                                                                        \
    TEXELS(slot, nodes)                                                                    \
    Grid grid_of_nodes() {                                                                 \
        uvec4 a = TEXEL(nodes, 2, 0, 0);                                                   \
        uvec4 b = TEXEL(nodes, 2, 0, 1);                                                   \
        return Grid(floats_of(a), last_of(a), floats_of(b), last_of(b));                   \
    }                                                                                      \
    Node node_at(uint index) {                                                             \
        uvec4 a = TEXEL(nodes, 2, index, 2);                                               \
        uvec4 b = TEXEL(nodes, 2, index, 3);                                               \
        return Node(a.xyz, a.w, b.xyz, b.w);                                               \
    }

#define OBJECTS(slot)                                                                      \
    TEXELS(slot, objects)                                                                  \
    Object object_at(uint index) {                                                         \
        uvec4 a = TEXEL(objects, 3, index, 0);                                             \
        uvec4 b = TEXEL(objects, 3, index, 1);                                             \
        uvec4 c = TEXEL(objects, 3, index, 2);                                             \
        return Object(floats_of(a), a.w, floats_of(b), int(b.w), floats_of(c), c.w);       \
    }

#define LIGHTS(slot)                                                                       \
    TEXELS(slot, lights)                                                                   \
    Light light_at(uint index) {                                                           \
        uvec4 a = TEXEL(lights, 4, index, 0);                                              \
        uvec4 b = TEXEL(lights, 4, index, 1);                                              \
        uvec4 c = TEXEL(lights, 4, index, 2);                                              \
        uvec4 d = TEXEL(lights, 4, index, 3);                                              \
        return Light(floats_of(a), last_of(a), floats_of(b), b.w,                          \
            floats_of(c), last_of(c), floats_of(d), last_of(d));                           \
    }

#define PLANAR_RECEIVERS(slot)                                                             \
    TEXELS(slot, planar_receivers)                                                         \
    PlanarReceiver planar_receiver_at(uint index) {                                        \
        uvec4 a = TEXEL(planar_receivers, 4, index, 0);                                    \
        uvec4 b = TEXEL(planar_receivers, 4, index, 1);                                    \
        uvec4 c = TEXEL(planar_receivers, 4, index, 2);                                    \
        uvec4 d = TEXEL(planar_receivers, 4, index, 3);                                    \
        return PlanarReceiver(floats_of(a), a.w, floats_of(b), b.w,                        \
            floats_of(c), c.w, floats_of(d), d.w);                                         \
    }

#define TRIANGLE_SPLATS(slot)                                                              \
    TEXELS(slot, triangle_splats)                                                          \
    TriangleSplat triangle_splat_at(uint index) {                                          \
        vec4 a = uintBitsToFloat(TEXEL(triangle_splats, 6, index, 0));                     \
        vec4 b = uintBitsToFloat(TEXEL(triangle_splats, 6, index, 1));                     \
        vec4 c = uintBitsToFloat(TEXEL(triangle_splats, 6, index, 2));                     \
        vec4 d = uintBitsToFloat(TEXEL(triangle_splats, 6, index, 3));                     \
        vec4 e = uintBitsToFloat(TEXEL(triangle_splats, 6, index, 4));                     \
        vec4 f = uintBitsToFloat(TEXEL(triangle_splats, 6, index, 5));                     \
        return TriangleSplat(a, b, c.xy, c.zw, d.xyz, d.w, e.xy, e.zw, f.xy, f.zw);        \
    }

#define FACETS(slot)                                                                       \
    TEXELS(slot, facets)                                                                   \
    Facet facet_at(uint index) {                                                           \
        uvec4 a = TEXEL(facets, 2, index, 0);                                              \
        uvec4 b = TEXEL(facets, 2, index, 1);                                              \
        return Facet(a.x, a.y, a.z, a.w, b.x, uintBitsToFloat(b.y), b.z, b.w);             \
    }

// One for each pair of facet and light and each receiver.
#define FACET_IMAGES(slot)                                                                 \
    TEXELS(slot, facet_images)                                                             \
    FacetImage facet_image_at(uint index) {                                                \
        uvec4 a = TEXEL(facet_images, 1, index, 0);                                        \
        return FacetImage(uintBitsToFloat(a.x), a.y, a.z, a.w);                            \
    }

// CLUSTER_STARTS for each patch cluster.
#define CLUSTER_STARTS_OF(slot)                                                            \
    TEXELS(slot, starts)                                                                   \
    ClusterStart cluster_start_at(uint index) {                                            \
        uvec4 a = TEXEL(starts, 2, index, 0);                                              \
        uvec4 b = TEXEL(starts, 2, index, 1);                                              \
        return ClusterStart(floats_of(a), a.w, floats_of(b), last_of(b));                  \
    }

#define SURFACES(slot)                                                                     \
    TEXELS(slot, surfaces)                                                                 \
    DiffuseSurface surface_at(uint index) {                                                \
        uvec4 a = TEXEL(surfaces, 6, index, 0);                                            \
        uvec4 b = TEXEL(surfaces, 6, index, 1);                                            \
        uvec4 c = TEXEL(surfaces, 6, index, 2);                                            \
        uvec4 d = TEXEL(surfaces, 6, index, 3);                                            \
        uvec4 e = TEXEL(surfaces, 6, index, 4);                                            \
        uvec4 f = TEXEL(surfaces, 6, index, 5);                                            \
        return DiffuseSurface(floats_of(a), a.w, floats_of(b), b.w, floats_of(c), c.w,     \
            floats_of(d), d.w, e.x, e.y, e.z, e.w, f.x, f.y, f.z, f.w);                    \
    }

#define CHAIN_PATHS(slot)                                                                  \
    TEXELS(slot, paths)                                                                    \
    ChainPath path_at(uint index) {                                                        \
        uvec4 a = TEXEL(paths, 8, index, 0);                                               \
        uvec4 b = TEXEL(paths, 8, index, 1);                                               \
        uvec4 c = TEXEL(paths, 8, index, 2);                                               \
        vec4 d = uintBitsToFloat(TEXEL(paths, 8, index, 3));                               \
        vec4 e = uintBitsToFloat(TEXEL(paths, 8, index, 4));                               \
        vec4 f = uintBitsToFloat(TEXEL(paths, 8, index, 5));                               \
        vec4 g = uintBitsToFloat(TEXEL(paths, 8, index, 6));                               \
        uvec4 h = TEXEL(paths, 8, index, 7);                                               \
        return ChainPath(floats_of(a), a.w, floats_of(b), last_of(b), floats_of(c), c.w,   \
            d, e, f, g, h.xy, h.zw);                                                       \
    }

#define PILOT_RAYS(slot)                                                                   \
    TEXELS(slot, pilot_rays)                                                               \
    PilotRay pilot_ray_at(uint index) {                                                    \
        uvec4 a = TEXEL(pilot_rays, 1, index, 0);                                          \
        return PilotRay(uintBitsToFloat(a.x), a.y, a.z, last_of(a));                       \
    }

#define CHAIN_HITS(slot)                                                                   \
    TEXELS(slot, hits)                                                                     \
    ChainHit hit_at(uint index) {                                                          \
        uvec4 a = TEXEL(hits, 2, index, 0);                                                \
        uvec4 b = TEXEL(hits, 2, index, 1);                                                \
        return ChainHit(uintBitsToFloat(a.x), a.y, uintBitsToFloat(a.zw), b.xy, b.z, b.w); \
    }

#define DIRECT_CELLS_OF(slot)                                                              \
    TEXELS(slot, direct_cells)                                                             \
    DirectCell direct_cell_at(uint index) {                                                \
        uvec4 a = TEXEL(direct_cells, 3, index, 0);                                        \
        uvec4 b = TEXEL(direct_cells, 3, index, 1);                                        \
        uvec4 c = TEXEL(direct_cells, 3, index, 2);                                        \
        return DirectCell(floats_of(a), last_of(a), floats_of(b), last_of(b),              \
            floats_of(c), last_of(c));                                                     \
    }

#define TEXTURED_TRIANGLES(slot)                                                           \
    TEXELS(slot, textured_triangles)                                                       \
    TexturedTriangle textured_triangle_at(uint index) {                                    \
        uvec4 a = TEXEL(textured_triangles, 2, index, 0);                                  \
        uvec4 b = TEXEL(textured_triangles, 2, index, 1);                                  \
        return TexturedTriangle(uintBitsToFloat(a.xy), uintBitsToFloat(a.zw),              \
            uintBitsToFloat(b.xy), b.z, b.w);                                              \
    }

#define TEXTURE_LEVELS(slot)                                                               \
    TEXELS(slot, texture_levels)                                                           \
    TextureLevel texture_level_at(uint index) {                                            \
        uvec4 a = TEXEL(texture_levels, 1, index, 0);                                      \
        return TextureLevel(a.xy, a.zw);                                               \
    }

