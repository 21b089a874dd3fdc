// The part of a light's disc that is above a plane. The including shader includes light.glsl.

struct DiscPart {
    vec3 direction;  // unit, toward the part's centroid
    float share;     // of the disc's light
    vec3 along;      // unit, across the disc and away from the plane
    float narrowed;  // standard deviation of the part along it, over the disc's
    float margin;    // < 0: no part is above the plane
};

// `plane` is the plane's unit normal. Parts of a sky, which are many, count by their centres.
DiscPart part_above(Light light, LightDisc disc, vec3 plane) {
    const float PI = radians(180.0);
    float radius = light.half_azimuth > 0.0 ? 0.0 : disc.angular_radius;
    float height = dot(plane, disc.direction);
    vec3 along = plane - height * disc.direction;
    DiscPart part = DiscPart(disc.direction, 1.0, along * inversesqrt(max(dot(along, along), 1e-20)), 1.0, height + radius);
    // A chord at the distance -h from the middle of the unit disc cuts off what is below. Moments of the rest over the disc's area.
    float h = clamp(height / max(radius, 1e-6), -1.0, 1.0);
    float half_chord = sqrt(1.0 - h * h);
    float angle = asin(h);
    float area = 0.5 + (h * half_chord + angle) / PI;
    float first = 2.0 / (3.0 * PI) * half_chord * half_chord * half_chord;
    float second = 0.125 + (angle - h * half_chord * (1.0 - 2.0 * h * h)) / (4.0 * PI);
    if (h < 1.0) {
        part.share = max(area, 0.0);
        float middle = min(first / max(area, 1e-5), 1.0);
        part.direction = normalize(disc.direction + radius * middle * part.along);
        part.narrowed = 2.0 * sqrt(max(second / max(area, 1e-5) - middle * middle, 0.0));
    }
    return part;
}

// Change of the direction across the disc, as it is across the part.
vec3 narrowed(DiscPart part, vec3 change) {
    return change - (1.0 - part.narrowed) * dot(part.along, change) * part.along;
}

// Toward the centroid of the irradiance that the part causes on a surface of the normal n. Irradiance is in proportion to the cosine: its
// centroid is beyond that of the part by the part's covariance times the change of the cosine, over the cosine.
vec3 brightest(DiscPart part, LightDisc disc, vec3 n) {
    float deviation = 0.5 * disc.angular_radius;
    float cosine = max(dot(n, part.direction), deviation);
    vec3 change = n - dot(n, part.direction) * part.direction;
    return normalize(part.direction + deviation * deviation / cosine * narrowed(part, narrowed(part, change)));
}
