// Rays from facets to lights and to planar receivers. The including shader includes facet.glsl and trace.glsl.

// Distance of a ray's start from the surface over the surface's size, so that the ray does not meet the facets next to
// its own.
const float RAY_OFFSET = 1e-4;

// The same over the largest of Surface.bulges: half of what the surface has beyond its plane.
const float OFFSET_OF_MERGED = 0.125;

bool is_inside(PlanarReceiver receiver, vec2 texel) {
    vec2 low = vec2(receiver.tile_x, receiver.tile_y);
    return all(greaterThanEqual(texel, low)) && all(lessThanEqual(texel, low + vec2(receiver.width, receiver.height)));
}

// Start of a ray in the direction `to`.
vec3 ray_start(Surface surface, vec2 st, vec3 to) {
    float offset = RAY_OFFSET * max(length(surface.edge1), length(surface.edge2));
    // The triangles that are merged have straight sides, on which a ray would start beneath the others.
    if (HAS_MERGED) offset += OFFSET_OF_MERGED * max(max(length(surface.bulges[0]), length(surface.bulges[1])), length(surface.bulges[2]));
    vec3 n = normal_at(surface, st);
    return position_at(surface, st) + (dot(n, to) < 0.0 ? -offset : offset) * n;
}

// Change of the light's direction from the centroid of the part of its disc to a point of it, which is in units of the disc's radius.
vec3 change_to(Light light, LightDisc disc, DiscPart part, vec2 point) {
    vec3 a, b;
    light_axes(light, disc, a, b);
    return 2.0 * narrowed(part, point.x * a + point.y * b);
}

// Whether light of a lobe arrives from a point of the part of the disc that lights st.
bool light_arrives(Surface surface, Light light, float eta, vec2 st, vec2 point) {
    vec3 x = position_at(surface, st);
    LightDisc disc = disc_at(light, x);
    DiscPart part = lit_part(surface, light, disc, normal_at(surface, st), eta);
    vec3 s = normalize(part.direction + change_to(light, disc, part, point));
    return !occluded(ray_start(surface, st, s), s, distance_to_light(light, x, s), surface.triangle);
}

bool light_leaves(Surface surface, vec2 st, PlanarReceiver receiver, vec2 texel) {
    vec3 target = from_texels(receiver, texel);
    vec3 start = ray_start(surface, st, target - position_at(surface, st));
    return !occluded(start, target - start, SHADOW_RAY_END, surface.triangle);
}
