// Clips patches that intersect a planar receiver. The including shader declares the buffer `planar_receivers` and the
// push constant `receiver_count`, and includes kernel.glsl and flux.glsl.

// Tolerance over the height of the patch: a patch that stands on a receiver is not clipped because of rounding.
const float ROUNDING = 1e-3;

// Heights of the patch's corners above the receiver's plane, m.
vec3 corner_heights(Patch patch_, PlanarReceiver receiver) {
    float height = dot(patch_.position - receiver.origin, receiver.normal);
    vec2 up = vec2(dot(patch_.edge1, receiver.normal), dot(patch_.edge2, receiver.normal));
    return height + vec3(dot(CORNERS[0], up), dot(CORNERS[1], up), dot(CORNERS[2], up));
}

float highest(vec3 heights) {
    return max(max(heights.x, heights.y), heights.z);
}

// Whether a part of the patch, or the whole patch, is behind the receiver.
bool reaches_behind(vec3 heights) {
    return min(min(heights.x, heights.y), heights.z) < -ROUNDING * highest(heights);
}

// The first receiver with at least the index `index` that intersects the patch, or receiver_count.
uint next_clipping_receiver(Patch patch_, uint index) {
    for (; index < push.receiver_count; index++) {
        vec3 heights = corner_heights(patch_, planar_receivers[index]);
        if (highest(heights) > 0.0 && reaches_behind(heights)) break;
    }
    return index;
}

// Whether the receiver `index` is lit in this pass. The pass receiver_count lights the receivers that do not clip the
// patch; the pass `clip` lights the receiver `clip` with the clipped patch. With a constant in place of receiver_count,
// projection takes about 5 % longer on lavapipe.
bool is_lit_by(Patch patch_, uint index, uint clip) {
    return clip < push.receiver_count ? index == clip : !reaches_behind(corner_heights(patch_, planar_receivers[index]));
}

// The part of an intersecting patch in front of the receiver, as a triangle with the same area, centroid and
// covariance.
Patch clipped_patch(Patch patch_, PlanarReceiver receiver) {
    vec3 heights = corner_heights(patch_, receiver);
    // The plane separates one corner, with the tip of the patch, from the two others.
    bvec3 before = greaterThan(heights, vec3(0.0));
    vec2 corner = CORNERS[2];
    vec2 p = CORNERS[0];
    vec2 q = CORNERS[1];
    heights = heights.zxy;
    if (before.y == before.z) {
        corner = CORNERS[0];
        p = CORNERS[1];
        q = CORNERS[2];
        heights = heights.yzx;
    } else if (before.x == before.z) {
        corner = CORNERS[1];
        p = CORNERS[2];
        q = CORNERS[0];
        heights = heights.zxy;
    }
    p -= corner;
    q -= corner;
    // Edge lengths, share of the area, and moments about the corner of the tip, in the basis p and q.
    vec2 ab = heights.x / (heights.x - heights.yz);
    float share = ab.x * ab.y;
    vec2 mean = share * ab / 3.0;
    vec3 square = share * vec3(ab.x * ab.x, 0.5 * ab.x * ab.y, ab.y * ab.y) / 6.0;
    if (heights.x <= 0.0) {
        share = 1.0 - share;
        mean = 1.0 / 3.0 - mean;
        square = vec3(1.0, 0.5, 1.0) / 6.0 - square;
    }
    // Rounding would dominate thinner slivers.
    share = max(share, 1e-6);
    mean /= share;
    vec3 covariance = square / share - outer2(mean);

    // The edges of a triangle with this covariance, one of them along q, by Cholesky's decomposition.
    float first = sqrt(max(covariance.x, 1e-12));
    float beside = covariance.y / first;
    float second = sqrt(max(covariance.z - beside * beside, 0.0));
    vec2 side1 = sqrt(18.0) * (first * p + (beside + second / sqrt(3.0)) * q);
    vec2 side2 = sqrt(24.0) * second * q;
    vec2 centre = corner + mean.x * p + mean.y * q;
    Patch clipped = patch_;
    clipped.position += centre.x * patch_.edge1 + centre.y * patch_.edge2;
    clipped.normal += centre.x * patch_.normal_du + centre.y * patch_.normal_dv;
    clipped.edge1 = side1.x * patch_.edge1 + side1.y * patch_.edge2;
    clipped.edge2 = side2.x * patch_.edge1 + side2.y * patch_.edge2;
    clipped.normal_du = side1.x * patch_.normal_du + side1.y * patch_.normal_dv;
    clipped.normal_dv = side2.x * patch_.normal_du + side2.y * patch_.normal_dv;
    clipped.area *= share;
    return clipped;
}
