// What a ray of a chain meets. The including shader includes trace.glsl, optics.glsl and media.glsl.

// Maximum number of ends of displaced bodies on a ray.
const uint MAX_PASSED = 16;

// The nearest interface, mirror or diffuse surface. Where one body ends within another that displaces it, the ray goes on as if
// nothing were there.
ChainHit hit_of(ChainPath path) {
    float travelled = 0.0;
    vec3 origin = path.position;
    uint self = path.triangle;
    uvec2 media = path.media;
    for (uint i = 0; i < MAX_PASSED; i++) {
        Hit hit = nearest(origin, path.direction, self, OCCLUDES | IS_MESH_RECEIVER);
        ChainHit found = ChainHit(travelled + hit.distance, hit.triangle, hit.barycentric, media, 0, 0);
        if (hit.triangle == NO_TRIANGLE) return found;
        Triangle triangle = triangle_at(hit.triangle);
        Object object = object_at(triangle.object);
        if (!is_body(object)) return found;
        uvec2 before, behind;
        bool front = dot(cross(triangle.edge1, triangle.edge2), path.direction) < 0.0;
        media_at(media, object, front, before, behind);
        if (filling(before).number != filling(behind).number) return found;
        travelled += hit.distance;
        origin += hit.distance * path.direction;
        self = hit.triangle;
        media = behind;
    }
    return ChainHit(FAR, NO_TRIANGLE, vec2(0.0), media, 0, 0);
}
