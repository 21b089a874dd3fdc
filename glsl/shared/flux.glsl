// The flux that a patch throws. The including shader declares the buffer `objects` and the push
// constant `trace`, and includes trace.glsl, sun.glsl and optics.glsl.

// A patch's corners, from its centroid, in edge1 and edge2.
const vec2 CORNERS[3] = vec2[](vec2(-1.0, -1.0) / 3.0, vec2(2.0, -1.0) / 3.0, vec2(-1.0, 2.0) / 3.0);

// The midpoints of the patch's sides, from its centroid, in edge1 and edge2. Their mean is exact
// for a quadratic map, and a third of the sum of their squares is the patch's covariance.
const vec2 MIDPOINTS[3] = vec2[](vec2(1.0, -2.0) / 6.0, vec2(-2.0, 1.0) / 6.0, vec2(1.0, 1.0) / 6.0);

// Root of that covariance: two displacements, in edge1 and edge2.
const vec2 AXES[2] = vec2[](vec2(0.5, -0.5) * sqrt(1.0 / 6.0), vec2(sqrt(0.5) / 6.0));

// Root of the covariance of the directions from which light comes, rad.
void axes_of(Light light, Sun sun, out vec3 a, out vec3 b) {
    a = light.axis1;
    b = light.axis2;
    if (light.is_lamp == 0) return;
    basis(sun.direction, a, b);
    a *= 0.5 * sun.angular_radius;
    b *= 0.5 * sun.angular_radius;
}

// Turns a patch that lets light through toward the direction s. Returns the index of refraction on
// that side over that beyond; 0 for a patch that only reflects.
float turn_toward(inout Patch patch_, vec3 s) {
    vec3 edge = patch_.edge1;
    vec3 bend = patch_.bend1;
    bool front = dot(cross(edge, patch_.edge2), s) >= 0.0;
    float ratio = ratio_of(objects[patch_.object], front);
    if (ratio == 0.0 || front) return ratio;
    patch_.normal = -patch_.normal;
    patch_.edge1 = patch_.edge2;
    patch_.bend1 = -patch_.bend2;
    patch_.edge2 = edge;
    patch_.bend2 = -bend;
    return ratio;
}

// Flux that the patch reflects and lets through, W: E A cos(theta) times the share, averaged over
// the midpoints; `sun` is what `light` is at the centroid. Not any where patch and light do not see
// each other.
bool flux_of(Patch patch_, Light light, Sun sun, float ratio, out vec3 flux[2]) {
    flux = vec3[](vec3(0.0), vec3(0.0));
    vec3 geometric = cross(patch_.edge1, patch_.edge2);
    bool reflects = dot(geometric, mirrored(sun.direction, normalize(patch_.normal))) > 0.0;
    if (dot(geometric, sun.direction) <= 0.0 || !reflects && ratio == 0.0) return false;
    float arriving = 0.0;
    vec3 reflected = vec3(0.0);
    Object object = objects[patch_.object];
    for (int i = 0; i < 3; i++) {
        vec2 st = MIDPOINTS[i];
        Sun here = sun_at(light, patch_.position + st.x * patch_.edge1 + st.y * patch_.edge2);
        vec3 n = normalize(patch_.normal + st.x * patch_.bend1 + st.y * patch_.bend2);
        float cosine = max(dot(n, here.direction), 0.0);
        if (cosine == 0.0) continue;
        arriving += here.falloff * cosine / 3.0;
        reflected += here.falloff * cosine / 3.0 * reflected_share(object, cosine, ratio);
    }
    if (arriving <= 0.0) return false;
    float way = way_to(light, patch_.position, sun.direction);
    if (push.trace != 0 && occluded(patch_.position, sun.direction, way, patch_.triangle)) return false;
    if (reflects) flux[0] = light.power * patch_.area * reflected;
    bool passes = ratio > 0.0 && dot(geometric, sent(sun.direction, normalize(patch_.normal), ratio)) < 0.0;
    if (passes) flux[1] = light.power * patch_.area * (arriving - reflected);
    return true;
}
