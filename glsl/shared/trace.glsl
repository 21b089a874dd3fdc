// Rays against the bounding volume hierarchy of the whole scene.
// The including shader declares the buffers `grid`, `nodes` and `triangles`.

const int STACK = 48;
const uint COUNT_SHIFT = 28;
const uint FIRST_MASK = (1u << COUNT_SHIFT) - 1u;
const uint NO_LINK = 0xffffffffu;
const uint NO_TRIANGLE = 0xffffffffu;

struct Hit {
    float distance;
    uint triangle;   // or NO_TRIANGLE
    vec2 barycentric; // weights of the second and third corner
};

// 1/d with zeros kept apart from infinity, so that slabs never give NaN.
vec3 safe_inverse(vec3 d) {
    vec3 tiny = vec3(1e-30);
    return 1.0 / mix(d, tiny, lessThan(abs(d), tiny));
}

// Distance at which a ray, in steps of the grid, enters a child's box, or infinity.
float enter(uvec3 box, vec3 origin, vec3 inverse, float limit) {
    vec3 a = (vec3(box & 0xffffu) - origin) * inverse;
    vec3 b = (vec3(box >> 16) - origin) * inverse;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    float t0 = max(max(near.x, near.y), max(near.z, 0.0));
    // Two ulps outward, so that a ray never slips between boxes (Ize 2013).
    float t1 = min(min(far.x, far.y), min(far.z, limit)) * 1.0000003;
    return t0 <= t1 ? t0 : 1.0 / 0.0;
}

// Moller & Trumbore 1997; both faces.
bool intersect(Triangle triangle, vec3 origin, vec3 direction, float limit, out float t, out vec2 uv) {
    vec3 p = cross(direction, triangle.edge2);
    float determinant = dot(triangle.edge1, p);
    vec3 s = origin - triangle.position;
    vec3 q = cross(s, triangle.edge1);
    uv = vec2(dot(s, p), dot(direction, q)) / determinant;
    t = dot(triangle.edge2, q) / determinant;
    // A zero determinant gives infinities or NaN, which fail these.
    return uv.x >= 0.0 && uv.y >= 0.0 && uv.x + uv.y <= 1.0 && t > 0.0 && t < limit;
}

// Whether a surface that casts shadows lies between origin and origin + limit * direction.
// The triangle `self`, where the ray starts, does not count.
// Rays that run side by side walk down together and test their leaves together (Aila & Laine 2009).
bool occluded(vec3 origin, vec3 direction, float limit, uint self) {
    vec3 start = (origin - grid.lower) * grid.scale;
    vec3 inverse = safe_inverse(direction * grid.scale);
    uint stack[STACK];
    stack[0] = NO_LINK;
    int top = 1;
    uint link = 0;
    for (;;) {
        while (link <= FIRST_MASK) {
            Node node = nodes[link];
            bool left = !isinf(enter(node.left, start, inverse, limit));
            bool right = !isinf(enter(node.right, start, inverse, limit));
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
            if (i != self && triangle.blocks != 0 && intersect(triangle, origin, direction, limit, t, uv)) return true;
        }
        link = stack[--top];
    }
}

// The nearest surface along a ray.
Hit nearest(vec3 origin, vec3 direction, uint self) {
    Hit hit = Hit(1.0 / 0.0, NO_TRIANGLE, vec2(0.0));
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
            if (!isinf(max(left, right)) && top < STACK) stack[top++] = left_first ? node.right_link : node.left_link;
            if (isinf(min(left, right))) link = stack[--top];
            else link = left_first ? node.left_link : node.right_link;
        }
        if (link == NO_LINK) return hit;
        uint first = link & FIRST_MASK;
        uint end = first + (link >> COUNT_SHIFT);
        for (uint i = first; i < end; i++) {
            float t;
            vec2 uv;
            if (i != self && intersect(triangles[i], origin, direction, hit.distance, t, uv)) {
                hit = Hit(t, i, uv);
            }
        }
        link = stack[--top];
    }
}
