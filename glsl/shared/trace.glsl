// Rays against the bounding volume hierarchy of the whole scene.
// The including shader declares the buffers `grid`, `nodes` and `triangles`.

const int STACK = 48;
const uint COUNT_SHIFT = 28;
const uint FIRST_MASK = (1u << COUNT_SHIFT) - 1u;
const uint NO_TRIANGLE = 0xffffffffu;
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

// Moller & Trumbore 1997; both faces.
bool intersect(Triangle triangle, vec3 origin, vec3 direction, float limit, out float t, out vec2 uv) {
    vec3 p = cross(direction, triangle.edge2);
    float determinant = dot(triangle.edge1, p);
    vec3 s = origin - triangle.position;
    vec3 q = cross(s, triangle.edge1);
    uv = vec2(dot(s, p), dot(direction, q)) / determinant;
    t = dot(triangle.edge2, q) / determinant;
    // What a division by zero gives is undefined.
    return determinant != 0.0 && uv.x >= 0.0 && uv.y >= 0.0 && uv.x + uv.y <= 1.0 && t > 0.0 && t < limit;
}

// The nearest surface that a ray meets before `limit`; or, for shadows, any that casts them. The
// flat surface of the triangle `self`, where the ray starts, does not count. `shadow` is a
// constant, so that the compiler keeps of each use only what it needs.
Hit follow(vec3 origin, vec3 direction, float limit, uint self, bool shadow) {
    Hit hit = Hit(limit, NO_TRIANGLE, vec2(0.0));
    uint twin = NO_TRIANGLE;
    if (self != NO_TRIANGLE) twin = triangles[self].twin;
    vec3 start = (origin - grid.lower) * grid.scale;
    vec3 inverse = safe_inverse(direction * grid.scale);
    uint stack[STACK];
    int top = 0;
    uint link = 0;
    for (;;) {
        uint count = link >> COUNT_SHIFT;
        if (count > 0) {
            uint first = link & FIRST_MASK;
            for (uint i = first; i < first + count; i++) {
                float t;
                vec2 uv;
                Triangle triangle = triangles[i];
                bool counts = i != self && i != twin && (!shadow || triangle.blocks != 0);
                if (counts && intersect(triangle, origin, direction, hit.distance, t, uv)) {
                    hit = Hit(t, i, uv);
                    if (shadow) return hit;
                }
            }
        } else {
            Node node = nodes[link];
            float left = enter(node.left, start, inverse, hit.distance);
            float right = enter(node.right, start, inverse, hit.distance);
            // Order matters only for the nearest.
            bool left_first = shadow ? left < FAR : left <= right;
            if (min(left, right) < FAR) {
                if (max(left, right) < FAR && top < STACK) stack[top++] = left_first ? node.right_link : node.left_link;
                link = left_first ? node.left_link : node.right_link;
                continue;
            }
        }
        if (top == 0) return hit;
        link = stack[--top];
    }
}

// Whether a surface that casts shadows lies between origin and origin + limit * direction, not
// counting the flat surface of the triangle `self`.
bool occluded(vec3 origin, vec3 direction, float limit, uint self) {
    return follow(origin, direction, limit, self, true).triangle != NO_TRIANGLE;
}

// The nearest surface along a ray, not counting the flat surface of the triangle `self`.
Hit nearest(vec3 origin, vec3 direction, uint self) {
    return follow(origin, direction, FAR, self, false);
}
