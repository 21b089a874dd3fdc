// The footprints of landings. The including shader includes chain.glsl, spectrum.glsl, kernel_fit.glsl and level_kernel.glsl, and
// declares `coarse`.

// A footprint without extent.
ChainFootprint no_footprint() {
    vec2 zero = vec2(0.0);
    return ChainFootprint(vec3(0.0), 0.0, vec3(0.0), 0.0, vec4(0.0), zero, zero, zero, 0.0, 0);
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

// Sum of the variances along rows and columns of a landing without the texel, texels^2. Up to the first a parallelogram stands for the
// landing, from the second on a kernel, and both between them.
const float WHOLLY_PARALLELOGRAM = 0.06;
const float WHOLLY_KERNEL = 0.5;
// Smallest side of a parallelogram, texels, and what its bounds are wider: rasterisation rounds.
const float SMALLEST_SIDE = 0.02;

// A root of the covariance m m^T + l l^T + isotropic that is near m where the others are small: the symmetric root times the rotation
// of m's polar decomposition.
mat2 root_near(mat2 m, mat2 l, float isotropic) {
    vec3 sum = covariance_of(m) + covariance_of(l) + isotropic * vec3(1.0, 0.0, 1.0);
    mat2 symmetric = symmetric_root(sum, sum.x * sum.z - sum.y * sum.y); // used where it is small
    float sense = determinant(m) < 0.0 ? -1.0 : 1.0;
    vec2 axis = m[0] + sense * vec2(m[1].y, -m[1].x);
    axis = dot(axis, axis) > 0.0 ? normalize(axis) : vec2(1.0, 0.0);
    return symmetric * mat2(axis, sense * vec2(-axis.y, axis.x));
}

// The footprint of a landing with `flux`, W, on receiver number `index`.
ChainFootprint footprint_of(Landing landing, vec3 flux, PlanarReceiver receiver, uint index) {
    Kernel kernel = kernel_for(landing.of_cell, landing.of_light, 1.0 / 12.0, SHARPEST_CURVED);
    LevelKernel here = in_level(kernel, landing.centre, receiver);
    kernel = here.kernel;
    if (here.level > 0) atomicOr(coarse[index], 1u << here.level);
    float peak = peak_of(kernel);
    // A small footprint is normalised over its texels.
    if (is_small(here)) {
        float sum = sum_over_texels(here, false, vec2(0.0), vec3(0.0, 0.0, 1.0));
        if (sum > 0.0) peak = 1.0 / sum;
    }
    // A kernel is evaluated at the middles of texels, and so it blurs what is narrower than a texel a second time. The image of the cell
    // as a parallelogram is exact there, but neighbours meet in no smooth way, which shows where it is as wide as a texel.
    vec3 own = covariance_of(landing.of_cell) + covariance_of(landing.of_light);
    float share = clamp((WHOLLY_KERNEL - own.x - own.z) / (WHOLLY_KERNEL - WHOLLY_PARALLELOGRAM), 0.0, 1.0);
    mat2 cell = landing.of_cell / sqrt(12.0 * push.spread);
    mat2 sides = sqrt(12.0) * root_near(cell, landing.of_light, SMALLEST_SIDE * SMALLEST_SIDE / 12.0);
    vec2 slant = landing.slant / here.scale;
    vec4 extent = share < 1.0 ? near_extent_of(kernel.profile.support * kernel.covariance, slant) : vec4(0.0);
    vec2 half_size = share > 0.0 ? 0.5 * (abs(sides[0]) + abs(sides[1])) + 0.5 + SMALLEST_SIDE : vec2(0.0);
    vec2 low = clamp(here.centre + min(extent.xy, -half_size), here.tile_low, here.tile_high);
    vec2 high = clamp(here.centre + max(extent.zw, half_size), here.tile_low, here.tile_high);
    if (!(kernel.determinant > 0.0)) high = low;
    vec3 irradiance = flux * (here.scale * here.scale / texel_area(receiver));
    return ChainFootprint(conic_of(kernel), kernel.profile.flatness, irradiance, (1.0 - share) * peak, vec4(sides[0], sides[1]), here.centre,
        low, high, share, packHalf2x16(slant));
}
