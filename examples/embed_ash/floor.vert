// The floor as two triangles.
#version 460

layout(push_constant) uniform Floor {
    mat4 clip_from_world;
    vec4 origin;       // a corner, m; w: scale across, from the floor's coordinates to those of the direct map
    vec4 edge_u;       // w: scale down
    vec4 edge_v;       // w: the offset, as unorm 2 x 16
    vec4 scale_offset; // from the floor's coordinates to those of the light map
} push;
layout(location = 0) out vec4 uv; // in the light map and in the direct map

const vec2 CORNERS[6] = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1));

void main() {
    vec2 corner = CORNERS[gl_VertexIndex];
    uv.xy = corner * push.scale_offset.xy + push.scale_offset.zw;
    uv.zw = corner * vec2(push.origin.w, push.edge_u.w) + unpackUnorm2x16(floatBitsToUint(push.edge_v.w));
    vec3 position = push.origin.xyz + corner.x * push.edge_u.xyz + corner.y * push.edge_v.xyz;
    gl_Position = push.clip_from_world * vec4(position, 1.0);
}
