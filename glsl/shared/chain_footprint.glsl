// The footprints of landings. The including shader includes chain.glsl, spectrum.glsl, kernel_fit.glsl and level_kernel.glsl, and
// declares `coarse`.

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

// Moves a landing to part number `part` of `parts` of its band, and gives its light that colour. Parts that are wider than the
// footprint, since there are too few, are blurred by their width.
void choose_part(inout Landing landing, inout vec3 flux, uint part, uint parts) {
    if (parts < 2 && landing.band.y == 1.0) return;
    float width = landing.band.y / float(parts);
    float first = landing.band.x + float(part) * width;
    flux *= weight_below(first + width) - weight_below(first);
    landing.centre += (first + 0.5 * width - landing.band.z) * landing.of_spectrum;
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
