// pack nodes: copies the boxes of the hierarchy to the nodes that rays traverse, with 16 bits for each side.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
TRIANGLES(0)
layout(std430, binding = 1) readonly buffer NodeBoxes { NodeBox node_boxes[]; };
layout(std430, binding = 2) buffer Nodes { Node nodes[]; }; // the first is the grid
layout(push_constant) uniform PackPush {
    uint node_count;
} push;

#include "blocks.glsl"
#include "child_box.glsl"

const float LAST = 65535.0; // largest grid coordinate
// Margin around the scene, grid steps. For a ray that starts 250 scene sizes away, rounding moves the start by one
// step. Boxes are therefore one step larger than their triangles, and the margin leaves space for that.
const float MARGIN = 4.0;

// In grid coordinates, at least one step larger than rounding requires.
uvec3 quantised(Box box, vec3 lower, vec3 scale) {
    // Conversion rounds toward zero.
    uvec3 low = uvec3((box.lower - lower) * scale - 1.0);
    uvec3 high = uvec3((box.upper - lower) * scale + 2.0);
    return low | high << 16;
}

void main() {
    uint index = thread_index();
    if (index >= push.node_count) return;
    Box root = Box(node_boxes[0].lower, node_boxes[0].upper);
    vec3 size = root.upper - root.lower;
    // A flat scene gets a small height, which avoids a division by zero.
    size = max(size, max(size.x, max(size.y, size.z)) / LAST);
    vec3 step_ = size / (LAST - 2.0 * MARGIN);
    vec3 lower = root.lower - MARGIN * step_;
    vec3 scale = 1.0 / step_;
    if (index == 0) nodes[0] = Node(floatBitsToUint(lower), 0, floatBitsToUint(scale), 0);
    uint at = index + 1;
    nodes[at].left = quantised(box_of(nodes[at].left_link), lower, scale);
    nodes[at].right = quantised(box_of(nodes[at].right_link), lower, scale);
}
