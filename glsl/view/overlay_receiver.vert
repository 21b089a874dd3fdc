// overlay receiver: surfaces with light maps, with places in the maps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)
OBJECTS(1)
SURFACES(2)
NORMALS(3)
layout(std430, binding = 4) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(location = 0) out vec2 place;              // in the light map, texels
layout(location = 1) out flat uvec4 tile;         // origin and size, texels
layout(location = 2) out flat uint is_planar;

#include "overlay.glsl"
#include "mesh_receiver.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"

void main() {
    uint index = gl_VertexIndex / 3;
    uint corner = gl_VertexIndex % 3;
    Triangle triangle = triangle_at(index);
    Object object = object_at(triangle.object);
    DiffuseSurface surface = surface_at(triangle.object);
    vec3 x = corner_of(triangle, corner);
    is_planar = surface.kind == PLANE ? 1 : 0;
    bool has_map = surface.light_width > 0 && (surface.kind == PLANE || surface.kind == ATLAS);
    tile = uvec4(surface.light_x, surface.light_y, surface.light_width, surface.light_height);
    if (is_planar != 0) {
        vec2 direct_place = to_texels(plane_of(surface), x) - vec2(surface.tile_x, surface.tile_y);
        place = direct_place * (vec2(tile.zw) / vec2(surface.width, surface.height));
    } else {
        int receiver = has_map ? object.receiver : 0;
        place = light_map_position(mesh_receivers[receiver], normals_at(index), vec2(corner == 1, corner == 2));
    }
    gl_Position = has_map ? seen_over(x) : NOWHERE;
}
