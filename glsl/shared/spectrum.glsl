// Light of many wavelengths. A coordinate s of wavelengths runs from 0 at the longest to 1 at the shortest, so that the index of
// refraction of a medium is linear in it (src/render/spectrum.rs). The including shader declares `weights_below`, the integrals of
// the colours from 0 to s = i/SPECTRAL_STEPS. The fourth element of the first three is the mean of s of a colour channel, beyond the
// coordinate of undispersed light.

// The colour of the light from 0 to s, linear sRGB; white for all of it.
vec3 weight_below(float s) {
    float place = clamp(s, 0.0, 1.0) * float(SPECTRAL_STEPS);
    uint index = min(uint(place), SPECTRAL_STEPS - 1);
    return mix(weights_below[index].rgb, weights_below[index + 1].rgb, place - float(index));
}
