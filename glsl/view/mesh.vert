// mesh: diffuse meshes with light maps, with places in the maps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)
OBJECTS(1)
SURFACES(2)
layout(std430, binding = 3) readonly buffer DrawnTriangles { uint drawn_triangles[]; };
NORMALS(4)
layout(std430, binding = 5) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
TEXTURED_TRIANGLES(8)
layout(location = 0) out vec2 place;              // in the tiles, texels
layout(location = 1) out flat vec4 tiles;         // origins in the direct map and in the light map
layout(location = 2) out flat vec2 size;          // of both
layout(location = 3) out flat vec3 albedo;
layout(location = 4) out flat uvec2 texture_levels_of; // first and number
layout(location = 5) out vec2 uv;                // of the texture

#include "camera.glsl"
#include "mesh_receiver.glsl"
#include "texture_corner.glsl"

invariant gl_Position;

void main() {
    uint index = drawn_triangles[push.first + gl_VertexIndex / 3];
    Triangle triangle = triangle_at(index);
    uint corner = gl_VertexIndex % 3;
    DiffuseSurface surface = surface_at(triangle.object);
    Object object = object_at(triangle.object);
    albedo = object.color;
    uv = texture_corner(index, corner, texture_levels_of);
    tiles = vec4(surface.tile_x, surface.tile_y, surface.light_x, surface.light_y);
    size = vec2(surface.width, surface.height);
    place = light_map_position(mesh_receivers[object.receiver], normals_at(index), vec2(corner == 1, corner == 2));
    gl_Position = seen_at(corner_of(triangle, corner));
}
