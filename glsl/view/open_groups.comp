// open groups: irradiance of each rect from each group of environment cells without shadows.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
SURFACES(0)
DIRECT_CELLS_OF(1)
layout(std430, binding = 2) writeonly buffer OpenGroups { vec4 open_groups[]; }; // DIRECT_CELL_GROUPS for each object, W/m^2
layout(push_constant) uniform OpenGroupsPush {
    uint count;          // of groups of all objects
} push;

void main() {
    uint index = gl_GlobalInvocationID.x;
    if (index >= push.count) return;
    DiffuseSurface surface = surface_at(index / DIRECT_CELL_GROUPS);
    const uint cells = DIRECT_CELLS / DIRECT_CELL_GROUPS;
    vec3 sum = vec3(0.0);
    for (uint i = 0; i < cells; i++) {
        DirectCell cell = direct_cell_at(index % DIRECT_CELL_GROUPS * cells + i);
        sum += max(dot(surface.normal, cell.mean), 0.0) * cell.power;
    }
    open_groups[index] = vec4(sum, 0.0);
}
