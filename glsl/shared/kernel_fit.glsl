// Fits a kernel to the image of a patch and a light. The including shader declares the buffer `profiles`.
//
// A covariance in the plane is given by a root R with the covariance R R^T: two vectors, such as the images of two
// axes. Determinants are sums of squared cross products (Cauchy & Binet), because the usual formula would cancel to
// nothing for footprints hundreds of texels long.
#include "kernel.glsl"

// Kernels of at most this many texels are normalised over the texels that they touch: a sum over so few texels differs from
// the integral.
const float MAX_NORMALISED_TEXELS = 36.0;
// The same of kernels that are at most so many texels wide along a row or a column.
const float MAX_NORMALISED_WIDTH = 6.0;
const float MAX_TEXELS_OF_LINE = 600.0;

struct Kernel {
    Profile profile;
    vec3 covariance;
    float determinant;
};

// The kernel for the covariance of a patch plus that of a disc-shaped light plus `isotropic` on each axis. The larger
// the light's share, the flatter the kernel. p is the exponent of the kernel (1 - t)^p that has the kurtosis of a disc
// with this share convolved with a Gaussian: 0 for the disc alone, unbounded without a disc, and at most `sharpest`
// here.
Kernel kernel_for(mat2 of_patch, mat2 of_light, float isotropic, float sharpest) {
    vec3 light = covariance_of(of_light);
    vec3 covariance = covariance_of(of_patch) + light + isotropic * vec3(1.0, 0.0, 1.0);
    mat2 crossed = mat2(
        cross2(of_patch[0], of_light[0]), cross2(of_patch[0], of_light[1]),
        cross2(of_patch[1], of_light[0]), cross2(of_patch[1], of_light[1]));
    float light_determinant = cross2(of_light[0], of_light[1]);
    light_determinant *= light_determinant;
    // Trace of adj(covariance) light.
    float both = 2.0 * light_determinant + dot(crossed[0], crossed[0]) + dot(crossed[1], crossed[1])
        + isotropic * (light.x + light.z);
    float patch_determinant = cross2(of_patch[0], of_patch[1]);
    float determinant = patch_determinant * patch_determinant + both - light_determinant
        + isotropic * (covariance.x + covariance.z - light.x - light.z - isotropic);

    float trace = both / determinant;
    float q = trace * trace - 4.0 / 3.0 * light_determinant / determinant;
    float p = min(max(8.0 / max(q, 1e-6) - 3.0, 0.0), sharpest);
    int last = profiles.length() - 1;
    float place = sqrt(p / SHARPEST) * float(last);
    int index = min(int(place), last - 1);
    Profile a = profiles[index];
    Profile b = profiles[index + 1];
    float f = place - float(index);
    Profile profile = Profile(mix(a.flatness, b.flatness, f), mix(a.support, b.support, f), mix(a.mean, b.mean, f), 0.0);
    return Kernel(profile, covariance, determinant);
}

// The kernel with the variance reduced by `isotropic` on each axis, and then all lengths scaled by `scale`.
Kernel rescaled(Kernel kernel, float isotropic, float scale) {
    vec3 m = kernel.covariance;
    float determinant = kernel.determinant - isotropic * (m.x + m.z - isotropic);
    m -= isotropic * vec3(1.0, 0.0, 1.0);
    float square = scale * scale;
    return Kernel(kernel.profile, m * square, determinant * square * square);
}

// The matrix of t = d^T conic d, the argument of kernel_value().
vec3 conic_of(Kernel kernel) {
    vec3 m = kernel.covariance;
    return vec3(m.z, -m.y, m.x) / (kernel.determinant * kernel.profile.support);
}

// The factor that normalises the integral of the kernel to 1.
float peak_of(Kernel kernel) {
    return 1.0 / (PI * kernel.profile.support * kernel.profile.mean * sqrt(kernel.determinant));
}
