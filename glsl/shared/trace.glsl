// Rays against the bounding volume hierarchy of the whole scene.
// The including shader declares the buffers `grid`, `nodes` and `triangles`.

const int STACK = 48;
const uint COUNT_SHIFT = 28;
const uint FIRST_MASK = (1u << COUNT_SHIFT) - 1u;
const uint NO_LINK = 0xffffffffu;
const uint NO_TRIANGLE = 0xffffffffu;
const float EDGE = 1e-6;
// Rays to a receiver are followed to this share of their length, so that it does not block itself.
const float SHADOW_RAY_END = 0.9999;
// Farther than anything, in m. GLSL promises no infinities.
const float FAR = 3.0e38;

struct Hit {
    float distance;
    uint triangle;   // or NO_TRIANGLE
    vec2 barycentric; // weights of the second and third corner
};

// 1/d with zeros kept apart from infinity, so that slabs never give NaN.
vec3 safe_inverse(vec3 d) {
    vec3 tiny = vec3(1e-20);
    return 1.0 / mix(d, tiny, lessThan(abs(d), tiny));
}

// Distance at which a ray, in steps of the grid, enters a child's box, or FAR.
float enter(uvec3 box, vec3 origin, vec3 inverse, float limit) {
    vec3 a = (vec3(box & 0xffffu) - origin) * inverse;
    vec3 b = (vec3(box >> 16) - origin) * inverse;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    float t0 = max(max(near.x, near.y), max(near.z, 0.0));
    // Two ulps outward, so that a ray never slips between boxes (Ize 2013).
    float t1 = min(min(far.x, far.y), min(far.z, limit)) * 1.0000003;
    return t0 <= t1 ? t0 : FAR;
}

// Moller & Trumbore 1997; both faces. A little larger than the triangle, since a ray through the
// edge of two would be rounded past both.
bool intersect(Triangle triangle, vec3 origin, vec3 direction, float limit, out float t, out vec2 uv) {
    vec3 p = cross(direction, triangle.edge2);
    float determinant = dot(triangle.edge1, p);
    vec3 s = origin - triangle.position;
    vec3 q = cross(s, triangle.edge1);
    uv = vec2(dot(s, p), dot(direction, q)) / determinant;
    t = dot(triangle.edge2, q) / determinant;
    // What a division by zero gives is undefined.
    return determinant != 0.0 && min(uv.x, uv.y) >= -EDGE && uv.x + uv.y <= 1.0 + EDGE && t > 0.0 && t < limit;
}

// The index of the other triangle of the flat surface that `self` is part of, where rays start.
uint twin_of(uint self) {
    return self == NO_TRIANGLE ? NO_TRIANGLE : triangles[self].twin;
}

// Whether a surface that casts shadows lies between origin and origin + limit * direction, not
// counting the flat surface of the triangle `self`. Rays that run side by side walk down together
// and test their leaves together (Aila & Laine 2009).
bool occluded(vec3 origin, vec3 direction, float limit, uint self) {
    uint twin = twin_of(self);
    vec3 start = (origin - grid.lower) * grid.scale;
    vec3 inverse = safe_inverse(direction * grid.scale);
    uint stack[STACK];
    stack[0] = NO_LINK;
    int top = 1;
    uint link = 0;
    for (;;) {
        while (link <= FIRST_MASK) {
            Node node = nodes[link];
            bool left = enter(node.left, start, inverse, limit) < FAR;
            bool right = enter(node.right, start, inverse, limit) < FAR;
            if (left && right && top < STACK) stack[top++] = node.right_link;
            link = left ? node.left_link : right ? node.right_link : stack[--top];
        }
        if (link == NO_LINK) return false;
        uint first = link & FIRST_MASK;
        uint end = first + (link >> COUNT_SHIFT);
        for (uint i = first; i < end; i++) {
            float t;
            vec2 uv;
            Triangle triangle = triangles[i];
            bool counts = i != self && i != twin && (triangle.flags & OCCLUDES) != 0;
            if (counts && intersect(triangle, origin, direction, limit, t, uv)) return true;
        }
        link = stack[--top];
    }
}

const uint ANY_TRIANGLE = ~0u;

// The nearest surface along a ray of those that have one of `bits` in Triangle.blocks, or ANY, not
// counting the flat surface of the triangle `self`. The same walk, nearer children first.
Hit nearest(vec3 origin, vec3 direction, uint self, uint bits) {
    Hit hit = Hit(FAR, NO_TRIANGLE, vec2(0.0));
    uint twin = twin_of(self);
    vec3 start = (origin - grid.lower) * grid.scale;
    vec3 inverse = safe_inverse(direction * grid.scale);
    uint stack[STACK];
    stack[0] = NO_LINK;
    int top = 1;
    uint link = 0;
    for (;;) {
        while (link <= FIRST_MASK) {
            Node node = nodes[link];
            float left = enter(node.left, start, inverse, hit.distance);
            float right = enter(node.right, start, inverse, hit.distance);
            bool left_first = left <= right;
            if (max(left, right) < FAR && top < STACK) stack[top++] = left_first ? node.right_link : node.left_link;
            if (min(left, right) < FAR) link = left_first ? node.left_link : node.right_link;
            else link = stack[--top];
        }
        if (link == NO_LINK) return hit;
        uint first = link & FIRST_MASK;
        uint end = first + (link >> COUNT_SHIFT);
        for (uint i = first; i < end; i++) {
            float t;
            vec2 uv;
            bool counts = i != self && i != twin && (bits == ANY_TRIANGLE || (triangles[i].flags & bits) != 0);
            if (counts && intersect(triangles[i], origin, direction, hit.distance, t, uv)) {
                hit = Hit(t, i, uv);
            }
        }
        link = stack[--top];
    }
}
