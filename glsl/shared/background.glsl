// What is seen where there is no object. The including shader declares the buffer `lights` and includes environment.glsl.

// rad; camera rays do not meet a smaller disc.
const float MIN_DISC = 1e-6;

// Radiance of suns and environment, W/m^2/sr.
vec3 background(vec3 direction, float rotation, uint light_count) {
    vec3 seen = HAS_ENVIRONMENT ? environment_radiance(direction, rotation, 0.0) : vec3(0.0);
    for (uint i = 0; i < light_count; i++) {
        if (light_at(i).is_lamp != 0) continue;
        // Compares chords, because the cosine of a small angle rounds to 1.
        float radius = light_at(i).size;
        bool inside = distance(direction, light_at(i).place) < 2.0 * sin(0.5 * radius);
        float sine = sin(radius);
        if (inside && radius > MIN_DISC) seen += light_at(i).power / (PI * sine * sine);
    }
    return seen;
}
