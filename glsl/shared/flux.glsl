// The flux that a patch throws. The including shader declares the buffer `objects` and the push
// constant `trace`, and includes trace.glsl and optics.glsl.

// The midpoints of the patch's sides, from its centroid, in edge1 and edge2. Their mean is exact
// for a quadratic map, and a third of the sum of their squares is the patch's covariance.
const vec2 MIDPOINTS[3] = vec2[](vec2(1.0, -2.0) / 6.0, vec2(-2.0, 1.0) / 6.0, vec2(1.0, 1.0) / 6.0);

// Flux through the patch, W: E A cos(theta) reflectance, cos(theta) averaged over the midpoints;
// zero where patch and light do not see each other.
vec3 flux_of(Patch patch_, Sun sun) {
    vec3 geometric = cross(patch_.edge1, patch_.edge2);
    vec3 r = mirrored(sun.direction, normalize(patch_.normal));
    if (dot(geometric, sun.direction) <= 0.0 || dot(geometric, r) <= 0.0) return vec3(0.0);
    float cosine = 0.0;
    for (int i = 0; i < 3; i++) {
        vec2 st = MIDPOINTS[i];
        vec3 n = normalize(patch_.normal + st.x * patch_.bend1 + st.y * patch_.bend2);
        cosine += max(dot(n, sun.direction), 0.0) / 3.0;
    }
    if (cosine <= 0.0) return vec3(0.0);
    if (push.trace != 0 && occluded(patch_.position, sun.direction, FAR, patch_.triangle)) return vec3(0.0);
    return sun.irradiance * objects[patch_.object].color * (cosine * patch_.area);
}
