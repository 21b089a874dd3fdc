// The medium that a ray is in: nested and overlapping dielectrics by priority (Schmidt & Budge 2002). A list of up to four
// objects that contain a place, in the order in which the ray entered them: 16 bits each, one more than the object's number;
// 0: none. The including shader declares `objects`.

const uint MEDIA_SLOTS = 4;

uint medium_in(uvec2 media, uint slot) {
    return (slot < 2 ? media.x : media.y) >> (16 * (slot & 1)) & 0xffffu;
}

uvec2 with_medium(uvec2 media, uint slot, uint medium) {
    uint bits = medium << (16 * (slot & 1));
    return slot < 2 ? uvec2(media.x | bits, media.y) : uvec2(media.x, media.y | bits);
}

uvec2 without_object(uvec2 media, uint object) {
    uvec2 left = uvec2(0);
    uint count = 0;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        uint medium = medium_in(media, slot);
        if (medium != 0 && medium != object + 1) left = with_medium(left, count++, medium);
    }
    return left;
}

uvec2 with_object(uvec2 media, uint object) {
    uint count = 0;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        uint medium = medium_in(media, slot);
        if (medium == object + 1) return media;
        if (medium != 0) count++;
    }
    return count < MEDIA_SLOTS ? with_medium(media, count, object + 1) : media;
}

// What fills a place: index of refraction, and absorption in 1/m. `object` is one more than its number; 0: air.
struct Medium {
    float ior;
    vec3 absorption;
    uint object;
};

// Of equal priorities, the object that was entered last.
Medium filling(uvec2 media) {
    Medium found = Medium(1.0, vec3(0.0), 0);
    float highest = -FAR;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        uint medium = medium_in(media, slot);
        if (medium == 0) break;
        Object object = object_at(medium - 1);
        if (object.index.y < highest) continue;
        highest = object.index.y;
        found = Medium(object.index.x, object.extinction, medium);
    }
    return found;
}

// The media on both sides of the surface of an object, on the front or the back of which a ray arrives that was in `media`.
// A ray on the back of a dielectric was in it.
void media_at(uvec2 media, uint number, Object object, bool front, out uvec2 before, out uvec2 behind) {
    before = behind = media;
    if (object.kind != DIELECTRIC || is_sheet(object)) return;
    uvec2 outside = without_object(media, number);
    uvec2 inside = with_object(media, number);
    before = front ? outside : inside;
    behind = front ? inside : outside;
}
