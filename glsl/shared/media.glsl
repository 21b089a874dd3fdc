// The medium that a ray is in: nested and overlapping bodies by priority (Schmidt & Budge 2002). A list of the media of up to
// four bodies that contain a place, in the order in which the ray entered them: 16 bits each, one more than `Object.receiver` of
// the body; 0: none. The including shader declares `objects`.

const uint MEDIA_SLOTS = 4;

uint medium_in(uvec2 media, uint slot) {
    return (slot < 2 ? media.x : media.y) >> (16 * (slot & 1)) & 0xffffu;
}

uvec2 with_medium(uvec2 media, uint slot, uint medium) {
    uint bits = medium << (16 * (slot & 1));
    return slot < 2 ? uvec2(media.x | bits, media.y) : uvec2(media.x, media.y | bits);
}

// One body of the medium `removed` less, the one that was entered last, if there is one.
uvec2 without_medium(uvec2 media, uint removed) {
    uint last = MEDIA_SLOTS;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        if (medium_in(media, slot) == removed) last = slot;
    }
    uvec2 left = uvec2(0);
    uint count = 0;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        uint medium = medium_in(media, slot);
        if (medium != 0 && slot != last) left = with_medium(left, count++, medium);
    }
    return left;
}

// One body more. Of more than four, the ones entered last are left out.
uvec2 and_medium(uvec2 media, uint added) {
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        if (medium_in(media, slot) == 0) return with_medium(media, slot, added);
    }
    return media;
}

// What fills a place: index of refraction, and absorption in 1/m. `number` is 0 for air.
struct Medium {
    float ior;
    vec3 absorption;
    uint number;
};

// Of equal priorities, the body that was entered last.
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

// The media on both sides of a surface, on the front or the back of which a ray arrives that was in `media`. A ray on the back of
// a body was in it.
void media_at(uvec2 media, Object object, bool front, out uvec2 before, out uvec2 behind) {
    before = behind = media;
    if (object.kind != DIELECTRIC || is_sheet(object)) return;
    uint medium = uint(object.receiver) + 1;
    if (front) {
        behind = and_medium(media, medium);
        return;
    }
    behind = without_medium(media, medium);
    if (behind == media) before = and_medium(media, medium);
}
