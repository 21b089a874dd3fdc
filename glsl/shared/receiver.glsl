// Receivers: positions on their planes and texels of the atlas.

// Position on the receiver's plane in texels of the atlas.
vec2 to_texels(Receiver receiver, vec3 position) {
    vec3 offset = position - receiver.origin;
    float u = dot(offset, receiver.edge_u) / dot(receiver.edge_u, receiver.edge_u);
    float v = dot(offset, receiver.edge_v) / dot(receiver.edge_v, receiver.edge_v);
    vec2 size = vec2(receiver.width, receiver.height);
    return vec2(receiver.tile_x, receiver.tile_y) + vec2(u, 1.0 - v) * size;
}

vec3 from_texels(Receiver receiver, vec2 texel) {
    vec2 uv = (texel - vec2(receiver.tile_x, receiver.tile_y)) / vec2(receiver.width, receiver.height);
    return receiver.origin + uv.x * receiver.edge_u + (1.0 - uv.y) * receiver.edge_v;
}

// Direction on the receiver's plane, in texels.
vec2 texel_direction(Receiver receiver, vec3 direction) {
    float u = dot(direction, receiver.edge_u) / dot(receiver.edge_u, receiver.edge_u);
    float v = dot(direction, receiver.edge_v) / dot(receiver.edge_v, receiver.edge_v);
    return vec2(u * float(receiver.width), -v * float(receiver.height));
}

// m^2
float texel_area(Receiver receiver) {
    return length(cross(receiver.edge_u, receiver.edge_v)) / float(receiver.width * receiver.height);
}
