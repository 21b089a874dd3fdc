// Places in the camera's picture. The including shader declares the camera as push constants.

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
