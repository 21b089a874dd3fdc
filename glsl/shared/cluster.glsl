// Patch clusters, which project environment cells onto planar receivers. The including shader includes
// planar_receiver.glsl, optics.glsl and flux.glsl.

// Whether a patch cluster is so close to the receiver for its size that it does not act as a pinhole. The limit is on
// squared size over squared height: with 1, clusters at a wall that stands on the caster lose 5 % of their light; with
// 0.1, a flat mirror has 1.5 times the L1.
bool is_close_cluster(Patch patch_, PlanarReceiver receiver) {
    float height = dot(patch_.position - receiver.origin, receiver.normal);
    float square = dot(patch_.edge1, patch_.edge1) + dot(patch_.edge2, patch_.edge2);
    return height > 0.0 && square > 0.3 * height * height;
}

// Root of the covariance of a cluster's image in texels, for light from the direction s that meets the receiver along r
// at `path`, m. Derivatives at the centroid, because rays from the ends of a large patch may miss the plane.
mat2 cluster_image(Patch patch_, vec3 s, vec3 normal, float eta, PlanarReceiver receiver, vec3 r, float path) {
    mat2 root;
    for (int i = 0; i < 2; i++) {
        vec2 st = AXES[i];
        vec3 normal_change = normalize_change(patch_.normal, st.x * patch_.normal_du + st.y * patch_.normal_dv);
        vec3 change = st.x * patch_.edge1 + st.y * patch_.edge2
            + path * outgoing_change(s, normal, vec3(0.0), normal_change, eta);
        root[i] = landing_change(receiver, r, change);
    }
    return root;
}

// The spread of a cluster's unit normals.
struct NormalChange {
    vec3 a;          // change along the patch's axes, a root of its covariance
    vec3 b;
    float rest;      // variance of what is not linear, across the mean normal on each axis
};

NormalChange normal_change_of(Patch patch_) {
    // The mean of unit normals is the shorter, the more they differ.
    float square = dot(patch_.normal, patch_.normal);
    NormalChange change;
    change.a = (AXES[0].x * patch_.normal_du + AXES[0].y * patch_.normal_dv) * inversesqrt(square);
    change.b = (AXES[1].x * patch_.normal_du + AXES[1].y * patch_.normal_dv) * inversesqrt(square);
    change.rest = 0.5 * max(1.0 / square - 1.0 - dot(change.a, change.a) - dot(change.b, change.b), 0.0);
    return change;
}

// Half the range of normal . d, as of an even distribution of the same variance. `n` is the mean unit normal.
float range_along(NormalChange change, vec3 n, vec3 d) {
    float a = dot(change.a, d);
    float b = dot(change.b, d);
    float aside = max(dot(d, d) - dot(n, d) * dot(n, d), 0.0);
    return sqrt(3.0 * (a * a + b * b + change.rest * aside));
}

// Gradient of -outgoing_direction(s, n, eta) . m with the normal.
vec3 normal_gradient(vec3 s, vec3 n, vec3 m, float eta) {
    float cosine = dot(n, s);
    if (eta == 0.0) return -2.0 * (dot(n, m) * s + cosine * m);
    float cos_t = sqrt(max(1.0 - eta * eta * (1.0 - cosine * cosine), 1e-12));
    return (cos_t - eta * cosine) * m - (eta - eta * eta * cosine / cos_t) * dot(n, m) * s;
}
