// Direct light at a point of a diffuse surface. The including shader declares the buffer `lights` and the sampler
// `environment`, and includes trace.glsl, light.glsl, optics.glsl, sampling.glsl and environment.glsl.

// Irradiance from the sun or lamp `index`, by `rays` rays to its disc. The disc's points are shared by `parts` samples;
// this is number `part` of them.
vec3 direct_light(uint index, vec3 x, vec3 n, uint self, uint part, uint rays, uint parts) {
    Light light = light_at(index);
    LightDisc disc = disc_at(light, x);
    // Where the whole lamp is above the horizon, the mean cosine over the lamp equals the cosine to its centre. The
    // rays then only sample visibility.
    float middle = dot(n, disc.direction);
    bool all_above = light.is_lamp != 0 && middle > sin(disc.angular_radius);
    float lit = 0.0;
    for (uint i = 0; i < rays; i++) {
        vec3 s = disc_direction(disc, disc_point(part + i * parts, rays * parts));
        float cosine = dot(n, s);
        if (cosine <= 0.0 || occluded(x, s, distance_to_light(light, x, s), self)) continue;
        lit += (all_above ? disc.falloff * middle : disc_weight(disc, s) * cosine) / float(rays);
    }
    return light.power * lit;
}

// Irradiance from the environment, by cosine-weighted rays. The `samples` rays are shared by `parts` samples; this is
// number `part` of them.
vec3 direct_environment(vec3 x, vec3 n, uint self, uint part, uint parts, uint samples, float rotation) {
    vec3 a, b;
    basis(n, a, b);
    vec3 sum = vec3(0.0);
    for (uint i = part; i < samples; i += parts) {
        vec2 p = disc_point(i, samples);
        float cosine = sqrt(max(1.0 - dot(p, p), 0.0));
        vec3 direction = p.x * a + p.y * b + cosine * n;
        if (occluded(x, direction, FAR, self)) continue;
        // The solid angle of a ray is pi / (samples cosine).
        float level = environment_level(sqrt(PI / (float(samples) * max(cosine, 0.1))));
        sum += environment_radiance(direction, rotation, level);
    }
    return sum * (PI * float(parts) / float(samples));
}
