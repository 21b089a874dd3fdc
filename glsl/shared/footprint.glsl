// The kernel for a covariance. The including shader declares the buffer `profiles`.
#include "kernel.glsl"

const int PROFILES = 64;

// peak kernel_value(shape, d^T conic d), with the covariance asked for and integral 1.
struct Kernel {
    vec3 conic;
    float shape;
    float peak;
};

// The kernel for a covariance, of which `light` is the share of a disc-shaped light: flatter the
// larger that share. Exponent p from the excess kurtosis that the disc leaves: a disc's is p = 0,
// a Gaussian's p = infinity.
Kernel kernel_for(vec3 covariance, vec3 light, float sharpest) {
    vec3 inverse = inverse2(covariance);
    float trace = trace2(inverse, light);
    float determinant = determinant2(inverse) * determinant2(light);
    float q = trace * trace - 4.0 / 3.0 * determinant;
    float p = clamp(8.0 / max(q, 1e-6) - 3.0, 0.0, sharpest);
    float shape = p, support = 2.0 * (p + 2.0), mean = 1.0 / (p + 1.0);
    if (p < 1.5) {
        float place = p / 1.5 * float(PROFILES - 1);
        int index = min(int(place), PROFILES - 2);
        Profile a = profiles[index];
        Profile b = profiles[index + 1];
        float f = place - float(index);
        shape = -mix(a.inner, b.inner, f);
        support = mix(a.support, b.support, f);
        mean = mix(a.mean, b.mean, f);
    }
    float peak = sqrt(determinant2(inverse)) / (PI * support * mean);
    return Kernel(inverse / support, shape, peak);
}
