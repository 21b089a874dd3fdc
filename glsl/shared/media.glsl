// The medium that a ray is in: nested and overlapping bodies by priority (Schmidt & Budge 2002). A list of the media of up to
// four bodies that contain a place, in the order in which the ray entered them: 16 bits each, one more than `Object.receiver` of
// the body; 0: none. The including shader declares `objects`, and includes optics.glsl.

const uint MEDIA_SLOTS = 4;

uint medium_in(uvec2 media, uint slot) {
    return (slot < 2 ? media.x : media.y) >> (16 * (slot & 1)) & 0xffffu;
}

uvec2 set_medium(uvec2 media, uint slot, uint medium) {
    uint bits = medium << (16 * (slot & 1));
    return slot < 2 ? uvec2(media.x | bits, media.y) : uvec2(media.x, media.y | bits);
}

// Leaves the body of this medium that was entered last, if there is one.
uvec2 leave_medium(uvec2 media, uint medium) {
    uint last = MEDIA_SLOTS;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        if (medium_in(media, slot) == medium) last = slot;
    }
    uvec2 rest = uvec2(0);
    uint count = 0;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        uint other = medium_in(media, slot);
        if (other != 0 && slot != last) rest = set_medium(rest, count++, other);
    }
    return rest;
}

// Enters a body. Beyond four bodies, the list stays as it is.
uvec2 enter_medium(uvec2 media, uint medium) {
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        if (medium_in(media, slot) == 0) return set_medium(media, slot, medium);
    }
    return media;
}

// What fills a place: index of refraction, those of the colour channels, its change over the spectrum, and absorption in 1/m.
// `number` is 0 for air.
struct Medium {
    float ior;
    vec3 ior_of_colours;
    float dispersion;
    vec3 absorption;
    uint number;
};

// Finds the medium of the body with the highest priority; among equal ones, of the body that was entered last.
Medium filling(uvec2 media) {
    Medium found = Medium(1.0, vec3(1.0), 0.0, vec3(0.0), 0);
    float highest = -FAR;
    for (uint slot = 0; slot < MEDIA_SLOTS; slot++) {
        uint medium = medium_in(media, slot);
        if (medium == 0) break;
        Object object = object_at(medium - 1);
        if (object.index.y < highest) continue;
        highest = object.index.y;
        found = Medium(object.index.x + spectral_offset * object.index.z, object.color, object.index.z, object.extinction, medium);
    }
    return found;
}

// Whether the object is a body, which a sheet is not.
bool is_body(Object object) {
    return object.kind == DIELECTRIC && !is_sheet(object);
}

// The media before and behind a surface that a ray in `media` meets on its front or its back. A ray that meets the back of a body
// was in it.
void media_at(uvec2 media, Object object, bool front, out uvec2 before, out uvec2 behind) {
    before = behind = media;
    if (!is_body(object)) return;
    uint medium = uint(object.receiver) + 1;
    if (front) {
        behind = enter_medium(media, medium);
        return;
    }
    behind = leave_medium(media, medium);
    if (behind == media) before = enter_medium(media, medium);
}
