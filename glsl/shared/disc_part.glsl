// The part of a disc of directions that is above a plane. The including shader declares BEAMS and includes light.glsl.

struct DiscPart {
    vec3 direction;  // unit, to the part's centroid
    float share;     // of the disc's light
    vec3 along;      // unit, across the disc and away from the plane
    float narrowed;  // standard deviation of the part along it, over the disc's
    float margin;    // < 0: no part is above the plane
};

// Angular radius of the disc that planes cut. Parts of a sky, which are many, and the lights of beams count by their centres.
float radius_of(Light light, LightDisc disc) {
    if (BEAMS) return 0.0;
    return light.half_azimuth > 0.0 ? 0.0 : disc.angular_radius;
}

// The part of the disc around `middle` where the sine of the angle above the plane of the unit normal `plane` is at least `least`.
DiscPart part_above(vec3 middle, float radius, vec3 plane, float least) {
    const float PI = radians(180.0);
    float sine = dot(plane, middle);
    vec3 along = plane - sine * middle;
    float across = sin(radius);
    DiscPart part = DiscPart(middle, 1.0, along * inversesqrt(max(dot(along, along), 1e-20)), 1.0, sine - least + across);
    // A chord at the distance -h from the middle of the unit disc cuts off what is below. Moments of the rest over the disc's area.
    float h = clamp((sine - least) / max(across, 1e-6), -1.0, 1.0);
    float half_chord = sqrt(1.0 - h * h);
    float angle = asin(h);
    float area = 0.5 + (h * half_chord + angle) / PI;
    float first = 2.0 / (3.0 * PI) * half_chord * half_chord * half_chord;
    float second = 0.125 + (angle - h * half_chord * (1.0 - 2.0 * h * h)) / (4.0 * PI);
    if (radius > 0.0 && h < 1.0) {
        part.share = max(area, 0.0);
        float mean = area > 1e-5 ? min(first / area, 1.0) : -h;
        part.direction = normalize(middle + radius * mean * part.along);
        part.narrowed = 2.0 * sqrt(max(second / max(area, 1e-5) - mean * mean, 0.0));
    }
    return part;
}

// Change of the direction across the disc, as it is across the part.
vec3 narrowed(DiscPart part, vec3 change) {
    return change - (1.0 - part.narrowed) * dot(part.along, change) * part.along;
}

// Toward the centroid of the irradiance that the part causes on a surface of the normal n. Irradiance is in proportion to the cosine: its
// centroid is beyond that of the part by the part's covariance times the change of the cosine, over the cosine.
vec3 brightest(DiscPart part, float radius, vec3 n) {
    if (radius == 0.0) return part.direction;
    float deviation = 0.5 * radius;
    float cosine = dot(n, part.direction);
    vec3 change = n - cosine * part.direction;
    return normalize(part.direction + deviation * deviation / max(cosine, deviation) * narrowed(part, narrowed(part, change)));
}
