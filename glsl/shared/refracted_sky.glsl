// Where light comes from that a surface refracts.

// Light that goes on along q, at `cosine` to the normal, came from the direction
// bend_at() n - q / ratio, `ratio` the index of refraction before the surface over that beyond. 0 where there is no surface:
// ratio 1.
float bend_at(float cosine, float ratio) {
    float before = sqrt(max(1.0 - (1.0 - cosine * cosine) / (ratio * ratio), 0.0));
    return before - cosine / ratio;
}
