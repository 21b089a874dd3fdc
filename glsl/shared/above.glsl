// A value that is evenly distributed over mean +- range, range >= 0.

// Mean of the value where it is positive, and of 0 elsewhere.
float mean_above(float mean, float range) {
    if (mean >= range) return mean;
    float above = max(mean + range, 0.0);
    return above * above / max(4.0 * range, 1e-20);
}

// Share of the values that is positive.
float share_above(float mean, float range) {
    if (abs(mean) >= range) return mean > 0.0 ? 1.0 : 0.0;
    return 0.5 + 0.5 * mean / range;
}
