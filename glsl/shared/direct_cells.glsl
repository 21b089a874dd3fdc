// Direct light of the environment by its cells. The including shader declares the buffer `direct_cells` and includes
// trace.glsl.

// Irradiance from the cells first, first + step, ... below first + count, times `step`, with a shadow ray to each. `blocked`
// is the share of it without shadows that is in shadow.
vec3 cells_irradiance(vec3 x, vec3 n, uint self, uint first, uint step_, uint count, out float blocked) {
    vec3 sum = vec3(0.0);
    vec3 open = vec3(0.0);
    for (uint i = 0; i < count; i += step_) {
        // Cells below the horizon are passed over in a loop of their own, which costs less than a ray.
        while (i + step_ < count && dot(n, direct_cell_at(first + i).mean) <= 0.0) i += step_;
        DirectCell cell = direct_cell_at(first + i);
        float cosine = max(dot(n, cell.mean), 0.0);
        // A cell that the horizon cuts.
        vec3 s = dot(n, cell.direction) > 0.0 ? cell.direction : normalize(cell.mean);
        open += cosine * cell.power;
        if (!occluded_by(OCCLUDES_ENVIRONMENT, x, s, FAR, self)) sum += cosine * cell.power;
    }
    vec3 weight = vec3(1.0);
    blocked = dot(open, weight) > 0.0 ? 1.0 - dot(sum, weight) / dot(open, weight) : 0.0;
    return float(step_) * sum;
}

vec3 cells_irradiance(vec3 x, vec3 n, uint self, uint first, uint step_, uint count) {
    float blocked;
    return cells_irradiance(x, n, self, first, step_, count, blocked);
}
