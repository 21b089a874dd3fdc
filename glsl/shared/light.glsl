// Suns and lamps as a point sees them. The including shader includes trace.glsl.

// A disc of even radiance.
struct LightDisc {
    vec3 direction;  // unit, toward its middle
    float angular_radius;
    float falloff;   // Light.power times this: W/m^2 on a plane that faces it
    float inverse_distance;  // 1/m: its direction turns by this much a metre; 0 for a distant sun
};

// What `light` shows at x: a sun the same everywhere, a lamp by its distance. A sphere of even
// radiance is a disc of the sine radius/distance, with the irradiance of a point in its middle.
LightDisc disc_at(Light light, vec3 x) {
    if (light.is_lamp == 0) return LightDisc(light.place, light.size, 1.0, 0.0);
    vec3 to_light = light.place - x;
    float inverse_distance = inversesqrt(dot(to_light, to_light));
    return LightDisc(to_light * inverse_distance, asin(min(light.size * inverse_distance, 1.0)), inverse_distance * inverse_distance, inverse_distance);
}

// How far a ray from x in the direction s, within the disc, runs until it meets the light.
float distance_to_light(Light light, vec3 x, vec3 s) {
    if (light.is_lamp == 0) return FAR;
    vec3 to_light = light.place - x;
    float along = dot(to_light, s);
    vec3 aside = to_light - along * s;
    return along - sqrt(max(light.size * light.size - dot(aside, aside), 0.0));
}
