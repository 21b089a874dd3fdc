// The difference of two texels: the mean of the channels' |a - b|, and relative to the mean of b if `is_relative`.

// Largest relative difference, which a texel has where only A is lit.
const float MAX_RELATIVE = 10.0;

float difference(vec3 a, vec3 b, bool is_relative) {
    const vec3 mean = vec3(1.0 / 3.0);
    float absolute = dot(abs(a - b), mean);
    if (!is_relative || absolute == 0.0) return absolute;
    return min(absolute / max(dot(b, mean), absolute / MAX_RELATIVE), MAX_RELATIVE);
}
