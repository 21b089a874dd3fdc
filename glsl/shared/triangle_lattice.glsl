// A lattice on a triangle: the patches of a facet, and the triangles of a patch.

// A triangle in the coordinates of its surface: corner, corner + side (1, 0) and corner + side (0, 1) for the two
// columns of sides.
struct Cell {
    vec2 corner;
    mat2 sides;
};

vec2 place_in(Cell cell, vec2 st) {
    return cell.corner + cell.sides * st;
}

// Cell `index` of the n^2 cells of a triangle, as (column, row) of its first corner and +1 or -1, the direction of its
// sides. Row r holds n - r upright cells and n - r - 1 inverted cells between them, 2 (n - r) - 1 in total. The `left`
// last cells, counting from this one, therefore fill more than m - 1 and at most m = n - r rows: m is the square root of
// `left`, rounded up.
ivec3 lattice_cell(uint index, uint n) {
    uint left = n * n - index;
    uint m = uint(ceil(sqrt(float(left))));
    // The float is wrong by at most one for all n < 2^16.
    if ((m - 1) * (m - 1) >= left) m--; else if (m * m < left) m++;
    uint column = m * m - left;
    bool turned = column % 2 == 1;
    return ivec3(ivec2(column / 2, n - m) + (turned ? 1 : 0), turned ? -1 : 1);
}

// The part of `whole` that cell `index` of n^2 is.
Cell cell_of(Cell whole, uint index, uint n) {
    ivec3 at = lattice_cell(index, n);
    return Cell(place_in(whole, vec2(at.xy) / float(n)), whole.sides * (float(at.z) / float(n)));
}

// Index of the lattice point (i, j), 0 <= i + j <= n, row by row.
uint lattice_point(uvec2 at, uint n) {
    return at.y * (n + 1) - at.y * (at.y - 1) / 2 + at.x;
}

// The inverse of lattice_point().
uvec2 lattice_place(uint index, uint n) {
    uint left = (n + 1) * (n + 2) / 2 - index; // points of this row and the next ones, from this one on
    uint m = uint(ceil(sqrt(2.0 * float(left) + 0.25) - 0.5)); // points of this row
    if (m * (m - 1) / 2 >= left) m--; else if (m * (m + 1) / 2 < left) m++;
    return uvec2(m * (m + 1) / 2 - left, n + 1 - m);
}

// The facet as a part of its triangle.
Cell facet_cell(Facet facet) {
    Cell whole = Cell(vec2(0.0), mat2(1.0));
    return cell_of(whole, facet.place & ((1u << FACET_DIVISION_SHIFT) - 1u), facet.place >> FACET_DIVISION_SHIFT);
}
