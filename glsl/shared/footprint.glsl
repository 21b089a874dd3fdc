// The kernel for a covariance. The including shader declares the buffer `profiles`.
#include "kernel.glsl"

const int PROFILES = 64;
const float SHARPEST = 4.0;

// peak kernel_value(flatness, d^T conic d), with the covariance asked for and integral 1.
struct Kernel {
    vec3 conic;
    float flatness;
    float peak;
};

// The kernel for a covariance, of which `light` is the share of a disc-shaped light: flatter the
// larger that share. p is the exponent of the kernel (1 - t)^p whose kurtosis is that of a disc
// with this share in a Gaussian: 0 for the disc alone, without bound for none.
Kernel kernel_for(vec3 covariance, vec3 light) {
    vec3 inverse = inverse2(covariance);
    float trace = trace2(inverse, light);
    float q = trace * trace - 4.0 / 3.0 * determinant2(inverse) * determinant2(light);
    float p = clamp(8.0 / max(q, 1e-6) - 3.0, 0.0, SHARPEST);

    float place = sqrt(p / SHARPEST) * float(PROFILES - 1);
    int index = min(int(place), PROFILES - 2);
    Profile a = profiles[index];
    Profile b = profiles[index + 1];
    float f = place - float(index);
    float support = mix(a.support, b.support, f);
    float peak = sqrt(determinant2(inverse)) / (PI * support * mix(a.mean, b.mean, f));
    return Kernel(inverse / support, mix(a.flatness, b.flatness, f), peak);
}
