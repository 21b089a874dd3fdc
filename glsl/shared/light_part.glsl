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
    // A plane that faces the part gets 1/cosine times the light of one that faces the whole, from 1/cosine times the distance.
    light.power /= cosine * cosine_2;
    light.size *= light.axis1.z / (cosine * sqrt(cosine));
    light.axis1 = vec3(0.0);
    return light;
}

// Where a ray in the direction d starts from a light's part, on the disc that the lamp turns toward d. The disc's first axis is u where d is that
// of the unit vector `ahead`, and turns along with it by the shortest way: turned about d, neighbouring rays would cross. Where the
// lamp is seen from everywhere at the same distance, the rays of all directions pass as evenly as from a point: each carries its share of the power.
vec3 start_along(Light light, vec3 d, vec3 u, vec3 ahead) {
    if (light.axis1.z == 0.0) return light.place;
    vec3 a = u - dot(u, d) / (1.0 + dot(ahead, d)) * (ahead + d);
    return light.place + light.size * (light.axis1.x * a + light.axis1.y * cross(d, a));
}

// The small lamp of a part at such a start.
Light part_at(Light light, vec3 place) {
    if (light.is_lamp == 0 || light.axis1.z == 0.0) return light;
    light.place = place;
    light.size *= light.axis1.z;
    return light;
}
