// Direct light without shadows. The including shader includes light.glsl.

// Irradiance of a plane with the unit normal n by a disc over Light.power. The mean cosine over a disc that is wholly above
// the horizon is the cosine to its centre, for the irradiance is a vector.
float open_irradiance(LightDisc disc, vec3 n) {
    return disc.falloff * max(dot(n, disc.direction), 0.0);
}

// Whether the horizon of the normal n cuts the disc.
bool is_cut(LightDisc disc, vec3 n) {
    return abs(dot(n, disc.direction)) < sin(disc.angular_radius);
}

bool is_below(LightDisc disc, vec3 n) {
    return dot(n, disc.direction) <= -sin(disc.angular_radius);
}
