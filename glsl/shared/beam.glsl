// Beams: all shadow rays from a small part of a surface to a light, tested against the scene at once. The including shader
// declares the buffers that trace.glsl needs, and includes trace.glsl, light.glsl and optics.glsl.

// Rays that start within `radius` of x, on or above the plane with the normal n, and stay within radius + t * growth of
// the line from x along the unit vector s, t metres from x, up to `end`.
struct Beam {
    vec3 x;
    vec3 n;
    vec3 s;
    float radius;
    float growth;
    float end;
    float below;     // triangles that rise less far above the plane meet no ray, m
    vec3 half_u;     // the rays start within x +- half_u +- half_v
    vec3 half_v;
};

// Shares of a beam's radius that a triangle rises above the plane at most by rounding, and by the curvature of a mesh.
const float ROUNDING = 1e-3;
const float CURVATURE = 0.1;

// The beam to the disc of a light.
Beam beam_to(Light light, LightDisc disc, vec3 x, vec3 n, vec3 half_u, vec3 half_v, float below) {
    float radius = max(length(half_u + half_v), length(half_u - half_v));
    float end = light.is_lamp == 0 ? FAR : 1.0 / disc.inverse_distance;
    // The hull of two spheres is narrower than the line between their radii times the factor.
    float growth = light.is_lamp == 0 ? tan(disc.angular_radius) : max(light.size - radius, 0.0) / end;
    return Beam(x, n, disc.direction, radius * (1.0 + growth) * (light.is_lamp == 0 ? 1.0 : 1.05), growth, end, below * radius, half_u, half_v);
}

// Whether the beam may meet something in a child's box. `along` is s over the grid's scale.
bool may_enter(uvec3 box, Beam beam, vec3 scale, vec3 start, vec3 inverse, vec3 along) {
    vec3 low = vec3(box & 0xffffu) - start;
    vec3 high = vec3(box >> 16) - start;
    bvec3 up = greaterThan(along, vec3(0.0));
    float last = dot(mix(low, high, up), along);
    float first = dot(mix(high, low, up), along);
    if (last < -beam.radius || first > beam.end) return false;
    vec3 margin = (beam.radius + clamp(last, 0.0, beam.end) * beam.growth) * scale;
    vec3 a = (low - margin) * inverse;
    vec3 b = (high + margin) * inverse;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    return max(max(near.x, near.y), near.z) <= min(min(far.x, far.y), far.z);
}

// Squared distance of the origin to the segment from a to b.
float segment_distance2(vec2 a, vec2 b) {
    vec2 edge = b - a;
    vec2 nearest = a + clamp(-dot(a, edge) / max(dot(edge, edge), 1e-30), 0.0, 1.0) * edge;
    return dot(nearest, nearest);
}

// What a triangle does to the beam: IS_LIT: it meets none of the rays; IS_DARK: it meets all of them; IS_MIXED: it may
// meet some.
uint shade_beam(Triangle triangle, Beam beam, vec3 across, vec3 aside) {
    vec3 p0 = triangle.position - beam.x;
    vec3 p1 = p0 + triangle.edge1;
    vec3 p2 = p0 + triangle.edge2;
    if (max(max(dot(p0, beam.n), dot(p1, beam.n)), dot(p2, beam.n)) <= beam.below) return IS_LIT;
    // Rays that all start on one side of the triangle's plane and go away from it miss the triangle.
    vec3 plane = cross(triangle.edge1, triangle.edge2);
    float size = length(plane);
    float height = -dot(p0, plane);
    float extent = abs(dot(beam.half_u, plane)) + abs(dot(beam.half_v, plane)) - beam.below * size;
    if (abs(height) >= extent && sign(height) * dot(beam.s, plane) >= beam.growth * size) return IS_LIT;
    vec3 t = vec3(dot(p0, beam.s), dot(p1, beam.s), dot(p2, beam.s));
    float last = max(max(t.x, t.y), t.z);
    float first = min(min(t.x, t.y), t.z);
    if (last < -beam.radius || first > beam.end) return IS_LIT;
    float radius = beam.radius + clamp(last, 0.0, beam.end) * beam.growth;
    vec2 a = vec2(dot(p0, across), dot(p0, aside));
    vec2 b = vec2(dot(p1, across), dot(p1, aside));
    vec2 c = vec2(dot(p2, across), dot(p2, aside));
    vec3 sides = vec3(a.x * b.y - a.y * b.x, b.x * c.y - b.y * c.x, c.x * a.y - c.y * a.x);
    bool inside = all(greaterThan(sides, vec3(0.0))) || all(lessThan(sides, vec3(0.0)));
    float edge2 = min(min(segment_distance2(a, b), segment_distance2(b, c)), segment_distance2(c, a));
    if (!inside && edge2 > radius * radius) return IS_LIT;
    return inside && edge2 > radius * radius && first > beam.radius && last < beam.end ? IS_DARK : IS_MIXED;
}

// What all triangles that cast shadows do to the beam. Without `finds_dark`, IS_MIXED stands for IS_DARK, too.
uint trace_beam(Beam beam, bool finds_dark) {
    vec3 across, aside;
    basis(beam.s, across, aside);
    Grid grid = grid_of_nodes();
    vec3 start = (beam.x - grid.lower) * grid.scale;
    vec3 along = beam.s / grid.scale;
    vec3 inverse = safe_inverse(beam.s * grid.scale);
    uint found = IS_LIT;
    uint stack[STACK + 1];
    stack[0] = NO_LINK;
    int top = 1;
    uint link = 0;
    for (;;) {
        while (link <= FIRST_MASK) {
            Node node = node_at(link);
            bool left = may_enter(node.left, beam, grid.scale, start, inverse, along);
            bool right = may_enter(node.right, beam, grid.scale, start, inverse, along);
            stack[top] = node.right_link;
            top += int(left && right && top < STACK);
            link = left ? node.left_link : right ? node.right_link : stack[--top];
        }
        if (link == NO_LINK) return found;
        uint first = link & FIRST_MASK;
        uint end = first + (link >> COUNT_SHIFT);
        for (uint i = first; i < end; i++) {
            Triangle triangle = triangle_at(i);
            if ((triangle.flags & OCCLUDES) == 0) continue;
            uint shade = shade_beam(triangle, beam, across, aside);
            if (shade == IS_DARK || shade == IS_MIXED && !finds_dark) return shade;
            found = max(found, shade);
        }
        link = stack[--top];
    }
}
