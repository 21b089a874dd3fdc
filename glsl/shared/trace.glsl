// Rays against the bounding volume hierarchy of the whole scene.
// The including shader declares the buffers `nodes` and `triangles`.

const int STACK = 48;
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

// Distance at which a ray enters a node, or infinity.
float enter(Node node, vec3 origin, vec3 inverse, float limit) {
    vec3 a = (node.lower - origin) * inverse;
    vec3 b = (node.upper - origin) * inverse;
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
bool occluded(vec3 origin, vec3 direction, float limit, uint self) {
    vec3 inverse = safe_inverse(direction);
    uint stack[STACK];
    int top = 0;
    uint index = 0;
    if (isinf(enter(nodes[0], origin, inverse, limit))) return false;
    for (;;) {
        Node node = nodes[index];
        if (node.count > 0) {
            for (uint i = node.first; i < node.first + node.count; i++) {
                float t;
                vec2 uv;
                Triangle triangle = triangles[i];
                if (triangle.blocks != 0 && i != self && intersect(triangle, origin, direction, limit, t, uv)) {
                    return true;
                }
            }
        } else {
            bool left = !isinf(enter(nodes[node.first], origin, inverse, limit));
            bool right = !isinf(enter(nodes[node.first + 1], origin, inverse, limit));
            if (left || right) {
                if (left && right && top < STACK) stack[top++] = node.first + 1;
                index = left ? node.first : node.first + 1;
                continue;
            }
        }
        if (top == 0) return false;
        index = stack[--top];
    }
}

// The nearest surface along a ray.
Hit nearest(vec3 origin, vec3 direction, uint self) {
    Hit hit = Hit(1.0 / 0.0, NO_TRIANGLE, vec2(0.0));
    vec3 inverse = safe_inverse(direction);
    uint stack[STACK];
    int top = 0;
    uint index = 0;
    if (isinf(enter(nodes[0], origin, inverse, hit.distance))) return hit;
    for (;;) {
        Node node = nodes[index];
        if (node.count > 0) {
            for (uint i = node.first; i < node.first + node.count; i++) {
                float t;
                vec2 uv;
                if (i != self && intersect(triangles[i], origin, direction, hit.distance, t, uv)) {
                    hit = Hit(t, i, uv);
                }
            }
        } else {
            float left = enter(nodes[node.first], origin, inverse, hit.distance);
            float right = enter(nodes[node.first + 1], origin, inverse, hit.distance);
            uint closer = left <= right ? node.first : node.first + 1;
            if (!isinf(min(left, right))) {
                if (!isinf(max(left, right)) && top < STACK) stack[top++] = closer == node.first ? node.first + 1 : node.first;
                index = closer;
                continue;
            }
        }
        if (top == 0) return hit;
        index = stack[--top];
    }
}
