// Texture coordinates for the graphics pipeline. The including vertex shader declares TEXTURED_TRIANGLES.

layout(constant_id = ID_HAS_TEXTURES) const bool HAS_TEXTURES = true;

// Texture coordinates of a triangle's corner; `levels`: first and number of the texture's levels.
vec2 texture_corner(uint index, uint corner, out uvec2 levels) {
    levels = uvec2(0);
    vec2 uv = vec2(0.0);
    if (HAS_TEXTURES) {
        TexturedTriangle triangle = textured_triangle_at(index);
        levels = uvec2(triangle.first_level, triangle.level_count);
        uv = corner == 0 ? triangle.uv0 : corner == 1 ? triangle.uv1 : triangle.uv2;
    }
    return uv;
}
