// Traces rays through the bounding volume hierarchy of the scene. The including shader declares NODES and TRIANGLES.

const uint FIRST_MASK = (1u << COUNT_SHIFT) - 1u;
const uint NO_LINK = 0xffffffffu;
const float EDGE = 1e-6;
// Shadow rays to a receiver end at this share of their length, so that the receiver does not occlude itself.
const float SHADOW_RAY_END = 0.9999;

struct Hit {
    float distance;
    uint triangle;   // or NO_TRIANGLE
    vec2 barycentric; // weights of the second and third corner
};

// 1/d with zeros replaced by tiny numbers, so that slab tests never give NaN.
vec3 safe_inverse(vec3 d) {
    vec3 tiny = vec3(1e-20);
    return 1.0 / mix(d, tiny, lessThan(abs(d), tiny));
}

// Distance at which a ray, in grid coordinates, enters a child's box, or FAR.
float enter(uvec3 box, vec3 origin, vec3 inverse, float limit) {
    vec3 a = (vec3(box & 0xffffu) - origin) * inverse;
    vec3 b = (vec3(box >> 16) - origin) * inverse;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    float t0 = max(max(near.x, near.y), max(near.z, 0.0));
    // Two ulps of slack, so that a ray never slips between boxes (Ize 2013).
    float t1 = min(min(far.x, far.y), min(far.z, limit)) * 1.0000003;
    return t0 <= t1 ? t0 : FAR;
}

// Ray-triangle intersection, both faces (Moller & Trumbore 1997). The triangle is enlarged slightly, because rounding
// could move a ray through a shared edge past both triangles.
bool intersect(Triangle triangle, vec3 origin, vec3 direction, float limit, out float t, out vec2 uv) {
    vec3 p = cross(direction, triangle.edge2);
    float determinant = dot(triangle.edge1, p);
    vec3 s = origin - triangle.position;
    vec3 q = cross(s, triangle.edge1);
    uv = vec2(dot(s, p), dot(direction, q)) / determinant;
    t = dot(triangle.edge2, q) / determinant;
    // Division by zero is undefined.
    return determinant != 0.0 && min(uv.x, uv.y) >= -EDGE && uv.x + uv.y <= 1.0 + EDGE && t > 0.0 && t < limit;
}

// Index of the other triangle of the rect that contains `self`, the triangle where rays start.
uint twin_of(uint self) {
    return self == NO_TRIANGLE ? NO_TRIANGLE : triangle_at(self).twin;
}

// Whether a triangle that has one of `bits` in Triangle.flags lies between origin and origin + limit * direction. The triangle
// `self` and its twin are ignored. Neighbouring rays descend together and test their leaves together (Aila & Laine 2009). The stack
// is written to whether the entry counts or not: lavapipe writes lane by lane, and if the lanes differ, with wrongly predicted
// branches that take half the time of a ray.
bool occluded_by(uint bits, vec3 origin, vec3 direction, float limit, uint self) {
    uint twin = twin_of(self);
    Grid grid = grid_of_nodes();
    vec3 start = (origin - grid.lower) * grid.scale;
    vec3 inverse = safe_inverse(direction * grid.scale);
    uint stack[STACK + 1];
    stack[0] = NO_LINK;
    int top = 1;
    uint link = 0;
    for (;;) {
        while (link <= FIRST_MASK) {
            Node node = node_at(link);
            bool left = enter(node.left, start, inverse, limit) < FAR;
            bool right = enter(node.right, start, inverse, limit) < FAR;
            stack[top] = node.right_link;
            top += int(left && right && top < STACK);
            link = left ? node.left_link : right ? node.right_link : stack[--top];
        }
        if (link == NO_LINK) return false;
        uint first = link & FIRST_MASK;
        uint end = first + (link >> COUNT_SHIFT);
        for (uint i = first; i < end; i++) {
            float t;
            vec2 uv;
            Triangle triangle = triangle_at(i);
            bool counts = i != self && i != twin && (triangle.flags & bits) != 0;
            if (counts && intersect(triangle, origin, direction, limit, t, uv)) return true;
        }
        link = stack[--top];
    }
}

// Whether an object that casts shadows lies between origin and origin + limit * direction.
bool occluded(vec3 origin, vec3 direction, float limit, uint self) {
    return occluded_by(OCCLUDES, origin, direction, limit, self);
}

const uint ANY_TRIANGLE = ~0u;

// The nearest triangle along a ray that has one of `bits` in Triangle.flags; ANY_TRIANGLE accepts all. The triangle
// `self` and its twin are ignored. The traversal visits nearer children first.
Hit nearest(vec3 origin, vec3 direction, uint self, uint bits) {
    Hit hit = Hit(FAR, NO_TRIANGLE, vec2(0.0));
    uint twin = twin_of(self);
    Grid grid = grid_of_nodes();
    vec3 start = (origin - grid.lower) * grid.scale;
    vec3 inverse = safe_inverse(direction * grid.scale);
    uint stack[STACK + 1];
    stack[0] = NO_LINK;
    int top = 1;
    uint link = 0;
    for (;;) {
        while (link <= FIRST_MASK) {
            Node node = node_at(link);
            float left = enter(node.left, start, inverse, hit.distance);
            float right = enter(node.right, start, inverse, hit.distance);
            bool left_first = left <= right;
            stack[top] = left_first ? node.right_link : node.left_link;
            top += int(max(left, right) < FAR && top < STACK);
            if (min(left, right) < FAR) link = left_first ? node.left_link : node.right_link;
            else link = stack[--top];
        }
        if (link == NO_LINK) return hit;
        uint first = link & FIRST_MASK;
        uint end = first + (link >> COUNT_SHIFT);
        for (uint i = first; i < end; i++) {
            float t;
            vec2 uv;
            Triangle triangle = triangle_at(i);
            bool counts = i != self && i != twin && (bits == ANY_TRIANGLE || (triangle.flags & bits) != 0);
            if (counts && intersect(triangle, origin, direction, hit.distance, t, uv)) {
                hit = Hit(t, i, uv);
            }
        }
        link = stack[--top];
    }
}
