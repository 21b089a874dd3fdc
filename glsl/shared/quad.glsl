// Expands splats into screen-aligned quads: four vertices per splat, and two triangles per quad by an index
// buffer (quads.rs, compact.comp).

layout(push_constant) uniform DrawPush {
    vec2 atlas_size;  // size of the light-map image, texels
} push;

// Corner of the rectangle from `lower` to `upper` for this vertex.
vec2 quad_corner(vec2 lower, vec2 upper) {
    return mix(lower, upper, vec2(gl_VertexIndex & 1, gl_VertexIndex >> 1 & 1));
}

// Clip-space position of a texel coordinate of the light-map image.
vec4 clip_position(vec2 texel) {
    return vec4(texel / push.atlas_size * 2.0 - 1.0, 0.0, 1.0);
}
