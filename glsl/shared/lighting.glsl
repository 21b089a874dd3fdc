// Direct light of suns and lamps on small parts of diffuse surfaces. The including shader declares the buffer `lights` and
// includes trace.glsl, light.glsl, optics.glsl, sampling.glsl and open_light.glsl.

const uint LIGHT_RAYS = LIGHT_RAYS_SIDE * LIGHT_RAYS_SIDE;

// Irradiance over Light.power along one ray of `rays` to the disc; its place on the disc is number `place`.
float ray_irradiance(Light light, vec3 x, vec3 n, uint self, uint place, uint rays) {
    LightDisc disc = disc_at(light, x);
    vec3 s = disc_direction(disc, disc_point(place, rays));
    float cosine = dot(n, s);
    if (cosine <= 0.0 || occluded(x, s, distance_to_light(light, x, s), self)) return 0.0;
    return is_cut(disc, n) ? disc_weight(disc, s) * cosine : open_irradiance(disc, n);
}
