// Parts of wide lamps, which the host divides (light_parts.rs). The including shader includes light.glsl and optics.glsl.

// Largest square of the sine between the middle of a lamp and a part.
const float LARGEST_SINE_2 = 0.9;

// The part of a lamp, as a small lamp before the middle of the whole; other lights as they are. The disc that the lamp shows is turned toward
// x, so that all places of a surface near x see the same small lamp.
Light part_seen_from(Light light, vec3 x) {
    if (light.is_lamp == 0 || light.axis1.z == 0.0) return light;
    vec3 way = light.place - x;
    float square = dot(way, way);
    vec3 a, b;
    basis(way * inversesqrt(square), a, b);
    vec2 centre = light.axis1.xy;
    // A place of the disc at the share q of its radius is seen at an angle of the sine q radius/distance.
    float cosine_2 = 1.0 - min(dot(centre, centre) * light.size * light.size / square, LARGEST_SINE_2);
    float cosine = sqrt(cosine_2);
    light.place += light.size / cosine * (centre.x * a + centre.y * b);
    // A plane that faces the part gets more light than one that faces the whole, by 1/cosine; the part's distance is square/cosine_2.
    light.power /= cosine * cosine_2;
    light.size *= light.axis1.z / (cosine * sqrt(cosine));
    light.axis1 = vec3(0.0);
    return light;
}

// The part of a lamp of which a ray in the direction d starts, as a small lamp; `axis` leans toward the first axis of its disc.
Light part_along(Light light, vec3 d, vec3 axis) {
    if (light.is_lamp == 0 || light.axis1.z == 0.0) return light;
    vec3 a = normalize(axis - dot(axis, d) * d);
    light.place += light.size * (light.axis1.x * a + light.axis1.y * cross(d, a));
    return light;
}

// The small lamp where a ray starts that part_along() has begun.
Light part_at(Light light, vec3 place) {
    if (light.is_lamp == 0 || light.axis1.z == 0.0) return light;
    light.place = place;
    light.size *= light.axis1.z;
    return light;
}

// Light of such a ray at this distance, over that where the disc is far away: the cosine of the angle between the middle and the part.
float share_at(Light light, float distance_) {
    if (light.is_lamp == 0 || light.axis1.z == 0.0) return 1.0;
    float sideward = length(light.axis1.xy) * light.size / distance_;
    return inversesqrt(1.0 + sideward * sideward);
}
