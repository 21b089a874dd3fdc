// How chains change at a surface, and the footprints of their landings. The including shader includes chain.glsl, spectrum.glsl,
// kernel_fit.glsl, level_kernel.glsl and light_axes.glsl, and declares `coarse`.

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
        Light light = light_at(light_of(path));
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

// The path of the reflected or the refracted lobe.
ChainPath next_path(ChainPath path, ChainHit hit, Interaction at, Transfer transfer, Lobe lobe, bool refracts) {
    Changes changes = transfer.changes;
    for (int i = 0; i < columns(); i++) {
        changes.direction[i] = outgoing_change(-path.direction, at.normal, -changes.direction[i], transfer.normal[i], refracts ? at.eta : 0.0);
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

// A footprint without extent.
Footprint no_footprint() {
    return Footprint(vec2(0.0), vec2(0.0), vec3(0.0), 0.0, vec3(0.0), 0.0, vec3(0.0), 0.0, vec2(0.0), vec2(0.0));
}

// A root of the covariance m m^T + d d^T, by Cholesky's decomposition.
mat2 widened(mat2 m, vec2 d) {
    float x = max(m[0].x * m[0].x + m[1].x * m[1].x + d.x * d.x, 1e-20);
    float xy = m[0].x * m[0].y + m[1].x * m[1].y + d.x * d.y;
    float y = m[0].y * m[0].y + m[1].y * m[1].y + d.y * d.y;
    float root = sqrt(x);
    return mat2(root, xy / root, 0.0, sqrt(max(y - xy * xy / x, 0.0)));
}

// Moves a landing to part number `part` of `parts` of the spectrum, and gives its light that colour. Parts that are wider than the
// footprint, since there are too few, are blurred by their width.
void choose_part(inout Landing landing, inout vec3 flux, uint part, uint parts) {
    if (parts < 2) return;
    float width = 1.0 / float(parts);
    float first = float(part) * width;
    flux *= weight_below(first + width) - weight_below(first);
    landing.centre += (first + 0.5 * width - push.spectral_middle) * landing.of_spectrum;
    if (float(parts) == MAX_PARTS) landing.of_cell = widened(landing.of_cell, inversesqrt(12.0) * width * landing.of_spectrum);
}

// The footprint of a landing with `flux`, W, on receiver number `index`.
Footprint footprint_of(Landing landing, vec3 flux, PlanarReceiver receiver, uint index) {
    Kernel kernel = kernel_for(landing.of_cell, landing.of_light, 1.0 / 12.0, SHARPEST_CURVED);
    LevelKernel here = in_level(kernel, landing.centre, receiver);
    kernel = here.kernel;
    vec2 low = clamp(here.centre - here.half_size, here.tile_low, here.tile_high);
    vec2 high = clamp(here.centre + here.half_size, here.tile_low, here.tile_high);
    if (!(kernel.determinant > 0.0)) high = low;
    if (here.level > 0) atomicOr(coarse[index], 1u << here.level);
    float peak = peak_of(kernel);
    vec3 irradiance = flux * (here.scale * here.scale * peak / texel_area(receiver));
    vec3 no_clip = vec3(0.0, 0.0, 1.0);
    // A small footprint is normalised over its texels.
    if (is_small(here)) {
        float sum = sum_over_texels(here, false, vec2(0.0), no_clip);
        if (sum > 0.0) irradiance /= sum * peak;
    }
    return Footprint(here.centre, vec2(0.0), conic_of(kernel), kernel.profile.flatness, irradiance, 0.0, no_clip, 0.0, low, high);
}
