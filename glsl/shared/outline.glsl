// Lines of constant width in the picture.

// Half the width of a line, pixels.
const float HALF_WIDTH = 0.6;
// Height of a shape below which its outline fades, so that many small ones do not cover the picture, pixels.
const float FADES = 8.0;
const float FAINTEST = 0.12;

// Coverage of a pixel by a line, from the distance to its middle in pixels.
float line_at(float pixels) {
    return clamp(HALF_WIDTH + 0.5 - pixels, 0.0, 1.0);
}

float faded(float height) {
    return clamp(height / FADES, FAINTEST, 1.0);
}

// Coverage by the outline of a shape that ends where one of three functions is 0 and reaches 1 across it.
float outline_of(vec3 inside) {
    vec3 change = max(fwidth(inside), vec3(1e-9));
    if (any(lessThan(inside, -change))) return 0.0;
    vec3 pixels = abs(inside) / change;
    float largest = max(max(change.x, change.y), change.z);
    return line_at(min(min(pixels.x, pixels.y), pixels.z)) * faded(1.0 / largest);
}

// Coverage by the line on which a kernel has half of its largest value, 1.
float contour_of(float kernel) {
    float change = max(fwidth(kernel), 1e-9);
    return line_at(abs(kernel - 0.5) / change) * faded(1.0 / change);
}
