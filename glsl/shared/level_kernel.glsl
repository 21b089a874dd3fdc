// Kernels in the levels of a light map. The including shader includes planar_receiver.glsl and kernel_fit.glsl.

// A kernel in a level of a light map, in texels of that level.
struct LevelKernel {
    Kernel kernel;
    int level;
    float scale;     // texels of the level over texels of the light map
    vec2 centre;     // in the light-map image
    vec2 half_size;  // of the kernel's bounding box
    vec2 tile_low;   // bounds of the level
    vec2 tile_high;
};

// The kernel, narrowed by the variance that interpolation adds.
LevelKernel on_level(Kernel kernel, vec2 centre, SplatLevel target) {
    LevelKernel result;
    result.level = target.level;
    result.scale = target.scale;
    result.centre = place_on(target, centre);
    result.kernel = rescaled(kernel, target.variance, target.scale);
    level_bounds(target.tile, target.level, result.tile_low, result.tile_high);
    result.half_size = sqrt(result.kernel.profile.support * result.kernel.covariance.xz);
    return result;
}

// The kernel in the coarsest level that its width allows: one whose standard deviation is at least 2^l texels in all directions
// goes to level l, where it covers fewer texels.
LevelKernel in_level(Kernel kernel, vec2 centre, PlanarReceiver receiver) {
    return on_level(kernel, centre, splat_level(receiver, min(minor_eigenvalue(kernel.covariance, kernel.determinant), 1e6)));
}

// Texels that the bounding box touches.
vec2 box_of(LevelKernel here) {
    return ceil(here.centre + here.half_size) - floor(here.centre - here.half_size) - 0.5;
}

// Whether the kernel is normalised over the texels that it touches: where these are few, or few beside each other, as along a line of
// light in a row of texels.
bool is_small(LevelKernel here) {
    vec2 box = box_of(here);
    float texels = box.x * box.y;
    return texels <= MAX_NORMALISED_TEXELS || min(box.x, box.y) <= MAX_NORMALISED_WIDTH && texels <= MAX_TEXELS_OF_LINE;
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
