// The bounding boxes of the children of the hierarchy's nodes. The including shader declares TRIANGLES and the buffer `node_boxes`.

struct Box {
    vec3 lower;
    vec3 upper;
};

bool is_leaf(uint link) {
    return link >> COUNT_SHIFT != 0;
}

Box box_of(uint link) {
    Box box = Box(vec3(FAR), vec3(-FAR));
    if (is_leaf(link)) {
        uint first = link & ((1u << COUNT_SHIFT) - 1);
        uint end = first + (link >> COUNT_SHIFT);
        for (uint i = first; i < end; i++) {
            Triangle triangle = triangle_at(i);
            vec3 a = triangle.position;
            vec3 b = a + triangle.edge1;
            vec3 c = a + triangle.edge2;
            box.lower = min(box.lower, min(a, min(b, c)));
            box.upper = max(box.upper, max(a, max(b, c)));
        }
    } else {
        box = Box(node_boxes[link].lower, node_boxes[link].upper);
    }
    return box;
}
