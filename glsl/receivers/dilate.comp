// dilate: texels around a mesh receiver's charts copy the nearest texel of a chart, so that interpolated look-ups at
// the edge of a chart stay valid.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = GROUP_SIDE, local_size_y = GROUP_SIDE) in;
layout(std430, binding = 0) readonly buffer MeshReceivers { MeshReceiver mesh_receivers[]; };
layout(std430, binding = 1) readonly buffer AtlasTexels { AtlasTexel atlas_texels[]; };
layout(binding = 2, rgba32f) uniform image2D light_map;
layout(push_constant) uniform DilatePush {
    uint receiver;       // index among the mesh receivers
    uint first_row;
    uvec2 tile;          // origin of the receiver's tile in this image
} push;

void main() {
    MeshReceiver receiver = mesh_receivers[push.receiver];
    uvec2 texel = gl_GlobalInvocationID.xy + uvec2(0, push.first_row);
    if (texel.x >= receiver.width || texel.y >= receiver.height) return;
    AtlasTexel own = atlas_texels[receiver.first_texel + texel.y * receiver.width + texel.x];
    // Sources lie in charts, so no source is written.
    if (own.area > 0.0 || own.source == NO_TEXEL) return;
    uvec2 source = uvec2(own.source % receiver.width, own.source / receiver.width);
    imageStore(light_map, ivec2(push.tile + texel), imageLoad(light_map, ivec2(push.tile + source)));
}
