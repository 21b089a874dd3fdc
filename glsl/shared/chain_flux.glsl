// The balance of the flux of chains (src/flux_balance.rs): sums of what comes in, and of where it ends. Sums are in fixed point with
// 64 bits, so that they do not depend on the order of additions.
//
// The including shader declares `flux_sums`, two words for each channel of each entry, and `weights_below`, and includes
// chain.glsl and spectrum.glsl.

// Adds flux, W, to an entry.
void count_flux(uint entry, vec3 flux) {
    for (int channel = 0; channel < 3; channel++) {
        float units = abs(flux[channel]) * push.flux_scale;
        uint high = uint(units * exp2(-32.0));
        uint low = uint(units - float(high) * exp2(32.0));
        if ((high | low) == 0) continue;
        if (flux[channel] < 0.0) {
            // Two's complement.
            low = ~low + 1;
            high = ~high + uint(low == 0);
        }
        uint word = 2 * (3 * entry + channel);
        uint before = atomicAdd(flux_sums[word], low);
        atomicAdd(flux_sums[word + 1], high + uint(before + low < before));
    }
}

// The colour of the light of a part of a path's band, from one share of its extent to another. All bands together are white.
vec3 colour_between(ChainPath path, float from, float to) {
    vec3 band = band_of(path);
    return weight_below(band.x + to * band.y) - weight_below(band.x + from * band.y);
}

// The colour of the light of a path.
vec3 colour_of(ChainPath path) {
    if (DISPERSES && band_of(path).y < 1.0) return colour_between(path, 0.0, 1.0);
    return vec3(1.0);
}

// The entry of light that lands on a receiver.
uint landed_entry(ChainPath path) {
    return FLUX_LANDED + min(interfaces_of(path), LANDED_ENTRIES) - 1;
}

// The entry of light that ends at the surface that it meets.
uint entry_at(ChainPath path, ChainHit hit) {
    Triangle triangle = triangle_at(hit.triangle);
    Object object = object_at(triangle.object);
    bool front = dot(cross(triangle.edge1, triangle.edge2), path.direction) < 0.0;
    if (object.kind == DIELECTRIC || object.kind != DIFFUSE && front) return FLUX_CUT_INTERFACES;
    if (object.kind != DIFFUSE || object.receiver == NO_RECEIVER || !front) return FLUX_ON_OTHER_SURFACES;
    return landed_entry(path);
}

// Counts the light of a path that ends with its hit. A ray of a lattice that is not for the caster that it meets counts nothing.
void count_end(ChainPath path, ChainHit hit) {
    if (is_first(path)) return;
    vec3 colour = colour_of(path);
    if (hit.triangle == NO_TRIANGLE) {
        count_flux(FLUX_LEFT_SCENE, colour * path.flux);
        return;
    }
    vec3 arriving = flux_after(path, hit.distance);
    count_flux(FLUX_IN_MEDIA, colour * (path.flux - arriving));
    count_flux(entry_at(path, hit), colour * arriving);
}

// Counts what a surface and the medium before it absorb.
void count_surface(ChainPath path, Interaction at) {
    vec3 colour = colour_of(path);
    if (is_first(path)) count_flux(FLUX_INCOMING, colour * at.flux);
    else count_flux(FLUX_IN_MEDIA, colour * (path.flux - at.flux));
    if (at.eta == 0.0) count_flux(FLUX_IN_MIRRORS, colour * (at.flux * (1.0 - at.reflectance)));
}

// Counts the lobes that are not followed, and what weak lobes on a sub-lattice have too little or too much: where one is not on it,
// its flux, and otherwise the flux of the three that it stands for beside its own, which it has too much.
void count_lobes(ChainPath path, Interaction at, Lobe lobes[2]) {
    vec3 colour = colour_of(path);
    for (int i = 0; i < 2; i++) {
        if (lobes[i].end == NO_LOBE) continue;
        vec3 flux = at.flux * (i == 0 ? at.reflectance : 1.0 - at.reflectance);
        if (!lobes[i].is_followed) count_flux(lobes[i].end, colour * flux);
        else if (lobes[i].is_weak) count_flux(FLUX_SAMPLING, colour * (flux - lobes[i].flux));
    }
}

// Counts the light of a path for which there is no room.
void count_lost(ChainPath path) {
    count_flux(FLUX_CUT_ROOM, colour_of(path) * path.flux);
}

// Counts flux of a path that was counted as landed, where there is no room for it.
void count_no_room_for(ChainPath path, vec3 flux) {
    count_flux(FLUX_CUT_ROOM, flux);
    count_flux(landed_entry(path), -flux);
}

// Counts light that landed on receiver number `receiver`, where there is no room for its footprints from part number `part` on.
void count_no_room(ChainPath path, ChainHit hit, uint receiver, uint part, uint parts) {
    if (hit.triangle == NO_TRIANGLE || entry_at(path, hit) != landed_entry(path)) return;
    Object object = object_at(triangle_at(hit.triangle).object);
    if (object.shape == MESH || object.receiver != int(receiver)) return;
    vec3 colour = parts == 1 ? colour_of(path) : colour_between(path, float(part) / float(parts), 1.0);
    vec3 flux = colour * flux_after(path, hit.distance);
    count_no_room_for(path, flux);
}

// Counts light that landed on a mesh receiver with the path's hit, where there is no room for its footprints.
void count_no_room_on_meshes(ChainPath path, ChainHit hit) {
    if (hit.triangle == NO_TRIANGLE || entry_at(path, hit) != landed_entry(path)) return;
    if (object_at(triangle_at(hit.triangle).object).shape != MESH) return;
    count_no_room_for(path, colour_of(path) * flux_after(path, hit.distance));
}
