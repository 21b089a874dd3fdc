// Albedo of textured surfaces that the graphics pipeline draws. The including fragment shader includes texture.glsl.

// `levels`: first and number of the texture's levels.
vec3 textured(vec3 albedo, uvec2 levels, vec2 uv) {
    if (HAS_TEXTURES) {
        // Before the inner branch, because derivatives compare the fragments of a quad.
        vec2 across = dFdx(uv);
        vec2 up = dFdy(uv);
        if (levels.y > 0) albedo *= colour_of_texture(levels.x, levels.y, uv, across, up);
    }
    return albedo;
}
