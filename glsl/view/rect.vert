// rect: diffuse rects, with places in their maps.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

TRIANGLES(0)
OBJECTS(1)
SURFACES(2)
layout(std430, binding = 3) readonly buffer DrawnTriangles { uint drawn_triangles[]; };
TEXTURED_TRIANGLES(6)
layout(location = 0) out vec4 places;             // in the direct map and in the light map, texels
layout(location = 1) out flat vec4 direct_tile;   // origin and size, texels
layout(location = 2) out flat vec4 light_tile;    // of size 0: no light map
layout(location = 3) out flat vec3 albedo;
layout(location = 4) out flat uvec2 texture_levels_of; // first and number
layout(location = 5) out vec2 uv;                // of the texture

#include "camera.glsl"
#include "planar_receiver.glsl"
#include "surface.glsl"
#include "texture_corner.glsl"

invariant gl_Position;

void main() {
    uint index = drawn_triangles[push.first + gl_VertexIndex / 3];
    Triangle triangle = triangle_at(index);
    uint corner = gl_VertexIndex % 3;
    vec3 x = corner_of(triangle, corner);
    DiffuseSurface surface = surface_at(triangle.object);
    albedo = object_at(triangle.object).color;
    uv = texture_corner(index, corner, texture_levels_of);
    direct_tile = vec4(surface.tile_x, surface.tile_y, surface.width, surface.height);
    light_tile = vec4(surface.light_x, surface.light_y, surface.light_width, surface.light_height);
    places.xy = to_texels(plane_of(surface), x);
    places.zw = light_tile.xy + (places.xy - direct_tile.xy) * (light_tile.zw / direct_tile.zw);
    gl_Position = seen_at(x);
}
