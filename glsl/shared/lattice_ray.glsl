// The rays of the lattices, as they leave their lights. The including shader declares `lattices`, and includes chain.glsl.

// Coarsest sub-lattice: every 4^MAX_LATTICE_LEVEL-th ray.
const uint MAX_LATTICE_LEVEL = 3;
// Where a ray passes its cell. Off the middle and the diagonals, since the edges of regular meshes often lie there, and a ray that
// meets an edge exactly may miss both triangles.
const vec2 WITHIN_CELL = vec2(0.4716, 0.5387);
#define FIRST_RAY(i) lattices[i].first

// The lattice of ray number `ray`.
ChainLattice lattice_of(uint ray) {
    SEARCH(found, 0, push.lattice_count, ray, FIRST_RAY)
    return lattices[found];
}

// Ray number `ray` as it leaves its light.
ChainPath ray_of_lattice(uint ray) {
    ChainLattice lattice = lattice_of(ray);
    Light light = light_at(lattice.light);
    uvec2 place = uvec2((ray - lattice.first) % lattice.columns, (ray - lattice.first) / lattice.columns);
    vec2 cell = vec2(place) + WITHIN_CELL;
    vec3 at = lattice.origin + cell.x * lattice.edge_u + cell.y * lattice.edge_v;
    uint level = min(uint(min(findLSB(place.x | 1u << MAX_LATTICE_LEVEL), findLSB(place.y | 1u << MAX_LATTICE_LEVEL))), MAX_LATTICE_LEVEL);
    ChainPath path;
    path.triangle = NO_TRIANGLE;
    path.counts = level << 16 | lattice.band << 24 | lattice.bands << 28;
    path.media = uvec2(0);
    path.start_or_spectrum = uvec2(lattice.object, lattice.light);
    float area = length(cross(lattice.edge_u, lattice.edge_v));
    Changes changes;
    changes.place[2] = changes.place[3] = changes.direction[2] = changes.direction[3] = vec3(0.0);
    if (light.is_lamp == 0) {
        path.position = at;
        path.direction = lattice.direction;
        path.flux = light.power * area;
        changes.place[0] = lattice.edge_u;
        changes.place[1] = lattice.edge_v;
        changes.direction[0] = changes.direction[1] = vec3(0.0);
    } else {
        vec3 way = at - light.place;
        float distance_ = length(way);
        path.position = light.place;
        path.direction = way / distance_;
        // The solid angle of the cell.
        float cosine = abs(dot(path.direction, cross(lattice.edge_u, lattice.edge_v))) / area;
        path.flux = light.power * (area * cosine / (distance_ * distance_));
        changes.place[0] = changes.place[1] = vec3(0.0);
        changes.direction[0] = normalize_change(way, lattice.edge_u);
        changes.direction[1] = normalize_change(way, lattice.edge_v);
    }
    path.first_flux = largest(path.flux);
    set_changes(path, changes);
    return path;
}
