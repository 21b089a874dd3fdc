// The rays of the lattices, as they leave their lights. The including shader includes chain.glsl and light_part.glsl.

// Coarsest sub-lattice: every 4^MAX_LATTICE_LEVEL-th ray.
const uint MAX_LATTICE_LEVEL = 3;
// Where a ray passes its cell. Off the middle and the diagonals, since the edges of regular meshes often lie there, and a ray that
// meets an edge exactly may miss both triangles.
const vec2 WITHIN_CELL = vec2(0.4716, 0.5387);

// The place of a ray, in cells whose columns and rows are halved `halved` times, after the shift of its lattice: what leaves on one side
// comes back on the other.
vec2 shifted(ChainLattice lattice, vec2 place, uvec2 halved) {
    vec2 cells = vec2(lattice.columns << halved.x, lattice.rows << halved.y);
    vec2 moved = place + exp2(vec2(halved)) * lattice.shift;
    return moved - floor(moved / cells) * cells;
}

// The ray at `place` of a lattice, in cells whose columns and rows are halved `halved` times, as it leaves its light. Without its band
// and its level.
ChainPath ray_at(ChainLattice lattice, vec2 place, uvec2 halved, LightPiece piece) {
    Light light = light_at(lattice.light);
    vec3 edge_u = exp2(-float(halved.x)) * lattice.edge_u;
    vec3 edge_v = exp2(-float(halved.y)) * lattice.edge_v;
    vec3 at = lattice.origin + place.x * edge_u + place.y * edge_v;
    ChainPath path;
    path.triangle = NO_TRIANGLE;
    path.counts = 0;
    path.media = uvec2(0);
    path.start_or_spectrum = uvec2(lattice.object, lattice.light);
    float area = length(cross(edge_u, edge_v));
    Changes changes;
    changes.place[2] = changes.place[3] = changes.direction[2] = changes.direction[3] = vec3(0.0);
    if (light.is_lamp == 0) {
        path.position = at;
        path.direction = lattice.direction;
        if (piece.centre != vec2(0.0)) {
            vec3 aside = piece.centre.x * light.axis1 + piece.centre.y * light.axis2;
            path.position += lattice.middle * aside;
            path.direction = normalize(path.direction - aside);
        }
        path.flux = light.power * area;
        changes.place[0] = edge_u;
        changes.place[1] = edge_v;
        changes.direction[0] = changes.direction[1] = vec3(0.0);
    } else {
        vec3 way = at - light.place;
        float distance_ = length(way);
        path.direction = way / distance_;
        vec3 u = normalize(edge_u), ahead = normalize(cross(edge_u, edge_v));
        vec3 straight = path.direction;
        path.position = start_along(light, straight, u, ahead);
        // The solid angle of the cell.
        float cosine = abs(dot(path.direction, cross(edge_u, edge_v))) / area;
        path.flux = light.power * (area * cosine / (distance_ * distance_));
        changes.place[0] = changes.place[1] = vec3(0.0);
        changes.direction[0] = normalize_change(way, edge_u);
        changes.direction[1] = normalize_change(way, edge_v);
        if (piece.centre != vec2(0.0)) {
            vec3 target = path.position + lattice.middle * straight;
            if (light.axis1.z == 0.0) light.axis1 = vec3(0.0, 0.0, 1.0);
            light.axis1.xy += 0.5 * light.axis1.z * piece.centre;
            path.position = start_along(light, straight, u, ahead);
            path.direction = normalize(target - path.position);
        }
    }
    for (int i = 0; i < 2; i++) {
        changes.place[i] *= piece.cells;
        changes.direction[i] *= piece.cells;
    }
    path.first_flux = largest(path.flux);
    set_changes(path, changes);
    return path;
}
