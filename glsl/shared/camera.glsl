// The camera's picture, as push constants of the graphics pipelines.

layout(push_constant) uniform CameraPush {
    vec3 eye;
    float near;          // m; nothing closer is seen
    vec3 right;          // half the picture's width at distance 1
    uint first;          // first of the triangles to draw
    vec3 up;             // half the picture's height at distance 1
    uint light_count;
    vec3 forward;        // unit
    float rotation;      // of the environment, rad
    vec2 size;           // of the picture, pixels
    vec2 tile;           // first pixel of the tile of the picture
} push;

// Clip space; the depth is near / distance, so that greater is nearer.
vec4 seen_at(vec3 position) {
    vec3 from = position - push.eye;
    float x = dot(from, push.right) / dot(push.right, push.right);
    float y = -dot(from, push.up) / dot(push.up, push.up);
    return vec4(x, y, push.near, dot(from, push.forward));
}

vec3 corner_of(Triangle triangle, uint corner) {
    return triangle.position + (corner == 1 ? triangle.edge1 : corner == 2 ? triangle.edge2 : vec3(0.0));
}
