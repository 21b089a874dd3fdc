// Suns and lamps as a point sees them. The including shader includes trace.glsl.

// A disc of even radiance.
struct Sun {
    vec3 direction;  // unit, toward its middle
    float angular_radius;
    float falloff;   // Light.power times this: W/m^2 on a plane that faces it
    float nearness;  // 1/m: its direction turns by this much a metre; 0 for a distant sun
};

// What `light` shows at x: a sun the same everywhere, a lamp by its distance. A sphere of even
// radiance is a disc of the sine radius/distance, with the irradiance of a point in its middle.
Sun sun_at(Light light, vec3 x) {
    if (light.is_lamp == 0) return Sun(light.place, light.size, 1.0, 0.0);
    vec3 way = light.place - x;
    float nearness = inversesqrt(dot(way, way));
    return Sun(way * nearness, asin(min(light.size * nearness, 1.0)), nearness * nearness, nearness);
}

// How far a ray from x in the direction s, within the disc, runs until it meets the light.
float way_to(Light light, vec3 x, vec3 s) {
    if (light.is_lamp == 0) return FAR;
    vec3 way = light.place - x;
    float along = dot(way, s);
    vec3 aside = way - along * s;
    return along - sqrt(max(light.size * light.size - dot(aside, aside), 0.0));
}
