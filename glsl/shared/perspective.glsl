// Perspective of light on the plane of a receiver: where light nearly grazes the plane, its rays have a longer way on the far side. The
// including shader includes planar_receiver.glsl and kernel.glsl.

// Standard deviation of the perspective, 1 / (1 - slant.d), above which an image is not an ellipse: that of the sun's disc is 0.01 where
// its light descends by 13 degrees.
const float LEAST_PERSPECTIVE = 0.01;
// Largest slant: a texel has no perspective.
const float LARGEST_SLANT = 0.25;

// A ray of direction r meets the plane after `distance_`, m. To first order a ray beside it meets the plane at d, in texels
// from there, and with perspective at d / (1 - slant.d).
vec2 slant_of(PlanarReceiver receiver, vec3 r, float distance_) {
    return vec2(dot(r, receiver.edge_u) / float(receiver.width), -dot(r, receiver.edge_v) / float(receiver.height)) / distance_;
}

// Where the place d, relative to the place of the slant, would be without perspective.
vec2 without_perspective(vec2 slant, vec2 d) {
    return d / (1.0 + dot(slant, d));
}

// Adds perspective to the rectangle from `low` to `high`, relative to the place of the slant. Where some of its rays never meet the
// plane, it becomes the whole of `tile`, or empty if the others miss that. Both sizes and `tile`, low and high, are relative to that
// place, too.
void add_perspective(vec2 slant, vec4 tile, inout vec2 low, inout vec2 high) {
    vec2 nearest = mix(high, low, greaterThan(slant, vec2(0.0)));
    vec2 farthest = mix(low, high, greaterThan(slant, vec2(0.0)));
    float most = dot(slant, farthest);
    if (most > 0.9) {
        float least = dot(slant, nearest);
        vec2 last = mix(tile.xy, tile.zw, greaterThan(slant, vec2(0.0)));
        bool is_missed = dot(slant, last) < least / (1.0 - least);
        low = is_missed ? vec2(1e9) : tile.xy;
        high = is_missed ? vec2(1e9) : tile.zw;
        return;
    }
    vec2 corners[4] = vec2[](low, vec2(high.x, low.y), high, vec2(low.x, high.y));
    low = vec2(1e9);
    high = vec2(-1e9);
    for (int i = 0; i < 4; i++) {
        vec2 corner = corners[i] / (1.0 - dot(slant, corners[i]));
        low = min(low, corner);
        high = max(high, corner);
    }
}

// Bounds of the plane's region that the rays within the ellipse d^T inverse(m) d <= 1 reach, as (low, high) relative to
// the centre. A ray meets the plane at d to first order, and at d / (1 + g.d) with perspective.
vec4 extent_of(vec3 m, vec2 g) {
    float gg = max(quadratic2(m, g), 0.0);
    vec2 mg = vec2(m.x * g.x + m.y * g.y, m.y * g.x + m.z * g.y);
    vec2 discriminant = mg * mg + (1.0 - gg) * m.xz;
    vec2 root = sqrt(max(discriminant, 0.0));
    vec2 a = (-mg - root) / (1.0 - gg);
    vec2 b = (-mg + root) / (1.0 - gg);
    if (gg < 1.0) return vec4(a, b);
    // Some rays never meet the plane, and the region is unbounded.
    vec2 nearest = mg / (sqrt(gg) * (1.0 + sqrt(gg)));
    vec2 low = mix(vec2(-FAR), max(a, b), greaterThanEqual(nearest, max(a, b)));
    vec2 high = mix(vec2(FAR), min(a, b), lessThanEqual(nearest, min(a, b)));
    bvec2 all_ = lessThan(discriminant, vec2(0.0));
    return vec4(mix(low, vec2(-FAR), all_), mix(high, vec2(FAR), all_));
}

// Value of slant.d, with d to first order, up to which light counts: what lies beyond is spread over an area 64 times as large.
const float FARTHEST = 0.75;

// The bounds of extent_of() for g = -slant, without what lies beyond FARTHEST.
vec4 near_extent_of(vec3 m, vec2 slant) {
    float deviation = sqrt(max(quadratic2(m, slant), 0.0));
    if (deviation < FARTHEST) return extent_of(m, -slant);
    // Conjugate radii of the ellipse: to where slant.d is largest, and along the lines of constant slant.d.
    vec2 ahead = vec2(m.x * slant.x + m.y * slant.y, m.y * slant.x + m.z * slant.y) / deviation;
    vec2 aside = vec2(-slant.y, slant.x) * (sqrt(max(m.x * m.z - m.y * m.y, 0.0)) / deviation);
    vec2 nearest = -ahead / (1.0 + deviation);
    vec2 farthest = ahead * (FARTHEST / (deviation * (1.0 - FARTHEST)));
    vec2 at_nearest = abs(aside) / (1.0 + deviation);
    vec2 at_farthest = abs(aside) / (1.0 - FARTHEST);
    return vec4(min(nearest - at_nearest, farthest - at_farthest), max(nearest + at_nearest, farthest + at_farthest));
}
