// Light at points of meshes. The including shader declares the buffer `point_light`.

// Direct light at a place along a row that begins at the point `first`, from 0 to 1.
vec3 light_of_row(int first, int intervals, float place) {
    float at = place * float(intervals);
    int column = clamp(int(at), 0, max(intervals - 1, 0));
    vec3 begin = point_light[first + column].rgb;
    return mix(begin, point_light[first + min(column + 1, intervals)].rgb, at - float(column));
}

// Direct light at a point of a triangle of kind POINTS, interpolated on its lattice.
vec3 light_of_points(TrianglePoints points, vec2 weights) {
    weights = max(weights, 0.0);
    weights /= max(weights.x + weights.y, 1.0);
    vec3 w = vec3(1.0 - weights.x - weights.y, weights);
    if (points.rows == 0) {
        return w.x * point_light[points.first].rgb + w.y * point_light[points.step_].rgb + w.z * point_light[points.apex].rgb;
    }
    int rows = int(points.rows);
    int step_ = int(points.step_);
    // Weights of the apex, and of the corner where rows end.
    vec2 at = points.apex == 0 ? w.xz : points.apex == 1 ? w.yx : w.zy;
    float height = at.x * float(rows);
    int row = min(int(height), rows - 1);
    float place = clamp(at.y / max(1.0 - at.x, 1e-6), 0.0, 1.0);
    int intervals = step_ * (rows - row);
    int first = int(points.first) + row + step_ * (row * rows - row * (row - 1) / 2);
    vec3 below = light_of_row(first, intervals, place);
    vec3 above = light_of_row(first + intervals + 1, intervals - step_, place);
    return mix(below, above, height - float(row));
}
