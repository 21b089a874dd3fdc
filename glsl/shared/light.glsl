// Suns and lamps as seen from a point. The including shader includes trace.glsl.

// A disc of constant radiance.
struct LightDisc {
    vec3 direction;  // unit, toward the centre
    float angular_radius;
    float falloff;   // Light.power times this is the irradiance of a plane that faces the disc, W/m^2
    float inverse_distance; // 1/m: change of the direction per metre across it; 0 for a sun
};

// The disc that `light` shows at x. A sun looks the same from everywhere, a lamp depends on the distance: a sphere of
// constant radiance is a disc with sin(angular radius) = radius / distance and the irradiance of a point at its centre.
LightDisc disc_at(Light light, vec3 x) {
    if (light.is_lamp == 0) return LightDisc(light.place, light.size, 1.0, 0.0);
    vec3 to_light = light.place - x;
    float inverse_distance = inversesqrt(dot(to_light, to_light));
    return LightDisc(to_light * inverse_distance, asin(min(light.size * inverse_distance, 1.0)), inverse_distance * inverse_distance, inverse_distance);
}

// Distance that a ray from x travels in the direction s, within the disc, until it meets the light.
float distance_to_light(Light light, vec3 x, vec3 s) {
    if (light.is_lamp == 0) return FAR;
    vec3 to_light = light.place - x;
    float along = dot(to_light, s);
    vec3 aside = to_light - along * s;
    return along - sqrt(max(light.size * light.size - dot(aside, aside), 0.0));
}
