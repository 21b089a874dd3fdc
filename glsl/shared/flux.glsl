// The flux that a patch reflects and refracts. The including shader declares the buffer `objects` and the push constant
// `can_occlude`, and includes trace.glsl, light.glsl and optics.glsl.

#include "light_axes.glsl"

// Midpoints of a patch's sides relative to its centroid, as coefficients of edge1 and edge2. The mean over the
// midpoints is exact for a quadratic map. A third of the sum of their squares is the covariance of the patch.
const vec2 MIDPOINTS[3] = vec2[](vec2(1.0, -2.0) / 6.0, vec2(-2.0, 1.0) / 6.0, vec2(1.0, 1.0) / 6.0);

// Root of that covariance: two offsets, as coefficients of edge1 and edge2.
const vec2 AXES[2] = vec2[](vec2(0.5, -0.5) * sqrt(1.0 / 6.0), vec2(sqrt(0.5) / 6.0));

// Whether the patch is flat: its interpolated normal is constant.
bool has_constant_normal(Patch patch_) {
    return patch_.normal_du == vec3(0.0) && patch_.normal_dv == vec3(0.0);
}

// Flips the patch of a dielectric so that its front faces the direction s. Returns the index of refraction on that side
// over the index on the other side; 0 for a patch that only reflects.
float orient_toward(inout Patch patch_, vec3 s) {
    vec3 edge = patch_.edge1;
    vec3 normal_du = patch_.normal_du;
    bool front = dot(cross(edge, patch_.edge2), s) >= 0.0;
    float eta = eta_of(object_at(patch_.object), front);
    if (eta == 0.0 || front) return eta;
    patch_.normal = -patch_.normal;
    patch_.edge1 = patch_.edge2;
    patch_.normal_du = -patch_.normal_dv;
    patch_.edge2 = edge;
    patch_.normal_dv = -normal_du;
    return eta;
}

// Flux that the patch reflects (0) and refracts (1), W: E A cos(theta) times the Fresnel factor, averaged over the
// midpoints. `disc` is the light as seen from the centroid. Returns false where the patch gets no light.
bool flux_of(Patch patch_, Light light, LightDisc disc, float eta, out vec3 flux[2]) {
    flux = vec3[](vec3(0.0), vec3(0.0));
    vec3 geometric = cross(patch_.edge1, patch_.edge2);
    bool reflects = dot(geometric, mirrored(disc.direction, normalize(patch_.normal))) > 0.0;
    if (dot(geometric, disc.direction) <= 0.0 || !reflects && eta == 0.0) return false;
    float arriving = 0.0;
    vec3 reflected = vec3(0.0);
    Object object = object_at(patch_.object);
    for (int i = 0; i < 3; i++) {
        vec2 st = MIDPOINTS[i];
        LightDisc here = disc_at(light, patch_.position + st.x * patch_.edge1 + st.y * patch_.edge2);
        vec3 n = normalize(patch_.normal + st.x * patch_.normal_du + st.y * patch_.normal_dv);
        float cosine = max(dot(n, here.direction), 0.0);
        if (cosine == 0.0) continue;
        arriving += here.falloff * cosine / 3.0;
        reflected += here.falloff * cosine / 3.0 * reflected_share(object, cosine, eta);
    }
    if (arriving <= 0.0) return false;
    float way = distance_to_light(light, patch_.position, disc.direction);
    if (push.can_occlude != 0 && occluded(patch_.position, disc.direction, way, patch_.triangle)) return false;
    if (reflects) flux[0] = light.power * patch_.area * reflected;
    bool passes = eta > 0.0 && dot(geometric, outgoing_direction(disc.direction, normalize(patch_.normal), eta)) < 0.0;
    if (passes) flux[1] = light.power * patch_.area * (arriving - reflected);
    return true;
}
