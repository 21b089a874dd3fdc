// Direct light of the environment by its cells. The including shader declares the buffer `direct_cells` and includes
// trace.glsl.

const uint CELLS_OF_GROUP = DIRECT_CELLS_SIDE * DIRECT_CELLS_SIDE;

// Irradiance of a plane with the unit normal n from a cell without shadows.
vec3 open_irradiance(DirectCell cell, vec3 n) {
    return max(dot(n, cell.mean), 0.0) * cell.power;
}

// Whether something lies between x and a cell that is not below the horizon.
bool is_cell_occluded(DirectCell cell, vec3 x, vec3 n, uint self) {
    // The horizon may cut the cell.
    vec3 s = dot(n, cell.direction) > 0.0 ? cell.direction : normalize(cell.mean);
    return occluded_by(OCCLUDES_ENVIRONMENT, x, s, FAR, self);
}

// Irradiance from the cells first, first + step, ... below end, times `step`, with a shadow ray to each.
vec3 cells_irradiance(vec3 x, vec3 n, uint self, uint first, uint step_, uint end) {
    vec3 sum = vec3(0.0);
    for (uint i = first; i < end; i += step_) {
        // Cells below the horizon are passed over in a loop of their own, which costs less than a ray.
        while (i + step_ < end && dot(n, direct_cell_at(i).mean) <= 0.0) i += step_;
        DirectCell cell = direct_cell_at(i);
        if (!is_cell_occluded(cell, x, n, self)) sum += open_irradiance(cell, n);
    }
    return float(step_) * sum;
}
