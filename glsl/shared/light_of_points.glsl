// Light at points of meshes. The including shader declares the buffer `point_light`.

// Direct light at a point of a triangle of kind POINTS, interpolated on its lattice.
vec3 light_of_points(TrianglePoints points, vec2 weights) {
    weights = max(weights, 0.0);
    weights /= max(weights.x + weights.y, 1.0);
    if (points.division == 1) {
        return (1.0 - weights.x - weights.y) * point_light[points.first].rgb + weights.x * point_light[points.second].rgb
            + weights.y * point_light[points.third].rgb;
    }
    int n = int(points.division);
    vec2 at = weights * float(n);
    ivec2 cell = ivec2(at);
    cell.y = min(cell.y, n - 1);
    cell.x = min(cell.x, n - 1 - cell.y);
    vec2 f = at - vec2(cell);
    // Row by row, each one point shorter than the row before.
    int row = int(points.first) + cell.y * (n + 1) - cell.y * (cell.y - 1) / 2 + cell.x;
    int next = row + n + 1 - cell.y;
    if (f.x + f.y <= 1.0) return (1.0 - f.x - f.y) * point_light[row].rgb + f.x * point_light[row + 1].rgb + f.y * point_light[next].rgb;
    return (f.x + f.y - 1.0) * point_light[next + 1].rgb + (1.0 - f.x) * point_light[next].rgb + (1.0 - f.y) * point_light[row + 1].rgb;
}
