// Kernels in the levels of a light map. The including shader includes planar_receiver.glsl and kernel_fit.glsl.

// A kernel with the coarsest level that its width allows, in texels of that level.
struct LevelKernel {
    Kernel kernel;
    int level;
    float scale;     // texels of the level over texels of the light map
    vec2 centre;     // in the light-map image
    vec2 half_size;  // of the kernel's bounding box
    vec2 tile_low;   // bounds of the level
    vec2 tile_high;
};

// A footprint whose standard deviation is at least 2^l texels in all directions goes to level l, where it covers fewer texels.
// Interpolation adds the variance (4^l - 1)/4, so the kernel is narrowed by that variance first.
LevelKernel in_level(Kernel kernel, vec2 centre, PlanarReceiver receiver) {
    LevelKernel result;
    float variance = min(minor_eigenvalue(kernel.covariance, kernel.determinant), 1e6);
    result.level = level_for(receiver, variance);
    Level tile = level_of(receiver, result.level);
    result.scale = 1.0 / float(1 << result.level);
    vec2 origin = vec2(receiver.tile_x, receiver.tile_y);
    result.centre = vec2(tile.origin) + (centre - origin) * result.scale;
    result.kernel = rescaled(kernel, 0.25 * (float(1 << 2 * result.level) - 1.0), result.scale);
    level_bounds(tile, result.level, result.tile_low, result.tile_high);
    result.half_size = sqrt(result.kernel.profile.support * result.kernel.covariance.xz);
    return result;
}

// Texels that the bounding box touches.
vec2 box_of(LevelKernel here) {
    return ceil(here.centre + here.half_size) - floor(here.centre - here.half_size) - 0.5;
}

bool is_small(LevelKernel here) {
    vec2 box = box_of(here);
    return box.x * box.y <= MAX_NORMALISED_TEXELS;
}

// Sum of a small kernel over the texels that it touches, relative to its peak. With `folded`, the kernel shifted by `shift` is
// added. Both are clipped by clip.z + clip.xy . d.
float sum_over_texels(LevelKernel here, bool folded, vec2 shift, vec3 clip) {
    vec3 conic = conic_of(here.kernel);
    float flatness = here.kernel.profile.flatness;
    vec2 box = box_of(here);
    vec2 first = floor(here.centre - here.half_size) + 0.5;
    float sum = 0.0;
    for (float y = 0.0; y < box.y; y += 1.0) {
        for (float x = 0.0; x < box.x; x += 1.0) {
            vec2 d = first + vec2(x, y) - here.centre;
            float value = kernel_value(flatness, quadratic2(conic, d));
            if (folded) value += kernel_value(flatness, quadratic2(conic, d - shift));
            sum += value * clamp(clip.z + dot(clip.xy, d), 0.0, 1.0);
        }
    }
    return sum;
}
