// refit: fits the boxes of the hierarchy's nodes to the triangles, level by level from the leaves to the root. A wide level has a
// dispatch of its own; one workgroup passes through all narrow ones.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_memory_scope_semantics : require
#include "gpu_types.glsl"

layout(local_size_x = REFIT_GROUP) in;
TRIANGLES(0)
NODES(1)
layout(std430, binding = 2) coherent buffer NodeBoxes { NodeBox node_boxes[]; };
// The ends of the levels among all nodes, then the nodes, level by level.
layout(std430, binding = 3) readonly buffer RefitOrder { uint refit_order[]; };
layout(push_constant) uniform RefitPush {
    uint first_level;
    uint end_level;   // first_level + 1 where there are several workgroups
    uint level_count; // of the hierarchy
} push;

#include "child_box.glsl"

void refit(uint index) {
    Node node = node_at(index);
    Box left = box_of(node.left_link);
    Box right = box_of(node.right_link);
    vec3 lower = min(left.lower, right.lower);
    vec3 upper = max(left.upper, right.upper);
    vec3 size = upper - lower;
    float cost = size.x * size.y + size.y * size.z + size.z * size.x;
    if (!is_leaf(node.left_link)) cost += node_boxes[node.left_link].cost;
    if (!is_leaf(node.right_link)) cost += node_boxes[node.right_link].cost;
    node_boxes[index] = NodeBox(lower, 0.0, upper, cost);
}

void main() {
    uint threads = gl_NumWorkGroups.x * REFIT_GROUP;
    for (uint level = push.first_level; level < push.end_level; level++) {
        uint first = level == 0 ? 0 : refit_order[level - 1];
        uint end = refit_order[level];
        for (uint i = first + gl_GlobalInvocationID.x; i < end; i += threads) refit(refit_order[push.level_count + i]);
        controlBarrier(gl_ScopeWorkgroup, gl_ScopeWorkgroup, gl_StorageSemanticsBuffer, gl_SemanticsAcquireRelease);
    }
}
