// How chains change at a surface. The including shader includes chain.glsl, light_axes.glsl and light_part.glsl.

// What changes of a path become at the surface that it meets.
struct Transfer {
    Changes changes;
    vec3 normal[5];  // of the normal
};

Transfer transfer_to(ChainPath path, ChainHit hit, Interaction at) {
    Triangle triangle = triangle_at(hit.triangle);
    Normals corner = normals_at(hit.triangle);
    vec3 d = path.direction;
    Transfer transfer;
    transfer.changes = changes_of(path);
    float along = dot(d, at.geometric);
    vec3 n0 = (1.0 - hit.barycentric.x - hit.barycentric.y) * corner.n0 + hit.barycentric.x * corner.n1 + hit.barycentric.y * corner.n2;
    bool is_smooth = at.normal != at.geometric;
    float e11 = dot(triangle.edge1, triangle.edge1);
    float e12 = dot(triangle.edge1, triangle.edge2);
    float e22 = dot(triangle.edge2, triangle.edge2);
    float determinant = e11 * e22 - e12 * e12;
    if (is_first(path)) {
        // The light varies in direction at a fixed place of the first surface. light_axes() points toward the light.
        Light light = piece_at(light_at(light_of(path)), path.position, piece_of_path(path), light_halvings_of_path(path));
        LightDisc disc = disc_at(light, path.position + hit.distance * d);
        light_axes(light, disc, transfer.changes.direction[2], transfer.changes.direction[3]);
        transfer.changes.direction[2] = -transfer.changes.direction[2];
        transfer.changes.direction[3] = -transfer.changes.direction[3];
    }
    for (int i = 0; i < columns(); i++) {
        vec3 place = transfer.changes.place[i] + hit.distance * transfer.changes.direction[i];
        if (is_first(path) && i >= 2) place = vec3(0.0);
        place -= d * (dot(place, at.geometric) / along);
        transfer.changes.place[i] = place;
        transfer.normal[i] = vec3(0.0);
        if (is_smooth) {
            float p1 = dot(place, triangle.edge1);
            float p2 = dot(place, triangle.edge2);
            vec2 uv = vec2(p1 * e22 - p2 * e12, p2 * e11 - p1 * e12) / determinant;
            transfer.normal[i] = normalize_change(n0, uv.x * (corner.n1 - corner.n0) + uv.y * (corner.n2 - corner.n0)) * at.side;
        }
    }
    return transfer;
}

// Largest change of direction over a cell or a light, rad. Where a cell is wider than the surface is curved, first-order changes are many
// times a hemisphere, and would spread the light over places that it cannot reach.
const float MAX_CHANGE = 1.0;

// The path of the reflected or the refracted lobe.
ChainPath next_path(ChainPath path, ChainHit hit, Interaction at, Transfer transfer, Lobe lobe, bool refracts) {
    Changes changes = transfer.changes;
    for (int i = 0; i < columns(); i++) {
        changes.direction[i] = outgoing_change(-path.direction, at.normal, -changes.direction[i], transfer.normal[i], refracts ? at.eta : 0.0);
        if (i < 4) changes.direction[i] *= MAX_CHANGE / max(length(changes.direction[i]), MAX_CHANGE);
    }
    if (DISPERSES && refracts) changes.direction[4] += at.eta_change * outgoing_change_with_eta(-path.direction, at.normal, at.eta);
    ChainPath next = next_ray(path, hit, at, lobe, refracts);
    if (lobe.is_weak) {
        next.counts += 1 << 8;
        for (int i = 0; i < 2; i++) {
            changes.place[i] *= 2.0;
            changes.direction[i] *= 2.0;
        }
    }
    set_changes(next, changes);
    return next;
}
