// Corners of a quad's two triangles, for an index buffer; see quad.glsl.
const uint QUAD_CORNERS[6] = uint[](0, 1, 2, 2, 1, 3);
