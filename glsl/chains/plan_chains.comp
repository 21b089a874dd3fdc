// plan chains: chooses how fine each lattice is to be, and estimates the error that this leaves on each receiver.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
layout(std430, binding = 0) readonly buffer Lattices { ChainLattice lattices[]; };
layout(std430, binding = 1) readonly buffer Pilots { LatticePilot lattice_pilots[]; };
layout(std430, binding = 2) readonly buffer Fluxes { vec4 lattice_fluxes[]; }; // see weigh_lattices.comp
layout(std430, binding = 3) coherent buffer Plans { LatticePlan lattice_plans[]; };
// Per receiver: relative L1 error that chains leave, and their share of its light; then the halvings that there was no room for.
layout(std430, binding = 4) buffer Errors { vec2 chain_errors[]; };
#include "chain_push.glsl"
#include "ray_cells.glsl"
// Whether a medium disperses light.
layout(constant_id = ID_DISPERSES) const bool DISPERSES = false;

// Chains add at most this share of the error to aim for to the light of their receivers. Where they are most of that light they may add more:
// in quadrature, patches are left the error to aim for of their own light.
const float MAX_ADDED = 0.5;
// A receiver with less than this share of all light is judged as if it had this share.
const float DIM_RECEIVER = 0.01;
// Error of the light of a lattice, from three figures that were fitted to glass balls, tumblers and irregular meshes with an error of 1 to
// 50 %. Over the root of the number of rays that land: that of kernels, and in addition where their neighbours disagree.
const float SMOOTH_ERROR = 2.5;
const float SCATTERED_ERROR = 8.0;
// That of cells whose neighbours disagree: a part of their light lands elsewhere.
const float INCOHERENT_ERROR = 0.4;
// That of directions of the light that land elsewhere than its middle, cautiously, by which its pieces are chosen. Rays are counted, and the error is
// estimated, by its expected value, since it falls with the root of the root of their number only.
const float DIRECTION_ERROR = 0.5;
const float EXPECTED_DIRECTION_ERROR = 0.27;
// Smaller pieces of the light are taken where they leave less than this share of the error.
const float CLEARLY_LESS = 0.9;
// Halvings beyond the refinements of the lattice.
const uint MORE_HALVINGS = 12;
// Halvings that cells near chains that land nowhere, and those near no chain, have less, at least.
const uint LESS_NEAR_CHAINS = 2;
const uint LESS_ELSEWHERE = 4;
// With fewer pilot rays that land, cells elsewhere keep more rays: much of the light may have been missed.
const float MANY_LANDINGS = 32.0;
// Where no pilot ray of a chain lands, up to about this number may have missed, whose neighbours disagree.
const float UNSEEN = 1.0;
const float UNSEEN_INCOHERENCE = 0.8;

// Part of the room for footprints that is planned for: their number is an estimate from few rays.
const float MAX_FILLED = 0.7;

// The light and the rays that land on each receiver, on all lattices. Receivers whose numbers are SPLAT_GROUP apart count as one.
shared vec2 landed[SPLAT_GROUP];

// The pilots of lattices that are planned together, as one.
struct Group {
    LatticePilot pilot;
    float cells; // their number in all lattices
    float share; // of the light of chains in the light of each receiver, added up
};
// Partial sums, one a thread: of a group, and of the numbers of rays and footprints.
shared Group groups[SPLAT_GROUP];
shared vec2 counts[SPLAT_GROUP];

uint receivers() {
    return push.receiver_count + push.mesh_count;
}

// Error of the light of chains of a lattice with so many halvings of its cells, and of the sides of its light, relative to this light.
float own_error(ChainLattice lattice, LatticePilot pilot, uint halvings, uint light_halvings, float direction_error) {
    // Rays that carry the same piece of the light are farther apart.
    float of_places = float(halvings) - 2.0 * float(light_halvings);
    float rays = max(float(pilot.landings), UNSEEN) * exp2(of_places);
    // The share of the cells that cross a discontinuity of the light falls with their side.
    float incoherent = pilot.landings == 0 ? UNSEEN_INCOHERENCE : min(pilot.incoherent.x / pilot.flux, 0.98);
    float crossed = -log(1.0 - incoherent) * exp2(float(lattice.refinements) - 0.5 * of_places);
    float misled = pilot.landings == 0 ? 0.0 : pilot.incoherent.y / pilot.flux * exp2(-float(light_halvings));
    float sparse = (SMOOTH_ERROR + SCATTERED_ERROR * incoherent) * inversesqrt(rays);
    vec3 error = vec3(sparse, INCOHERENT_ERROR * (1.0 - exp(-crossed)), direction_error * misled);
    return min(length(error), 1.0);
}

// How often the sides of the light are best halved with so many halvings of the cells.
uint light_halvings_for(ChainLattice lattice, LatticePilot pilot, uint halvings) {
    uint best = 0;
    for (uint tried = 1; tried <= min(MAX_LIGHT_HALVINGS, halvings / 2); tried++) {
        float error = own_error(lattice, pilot, halvings, tried, DIRECTION_ERROR);
        if (error < CLEARLY_LESS * own_error(lattice, pilot, halvings, best, DIRECTION_ERROR)) best = tried;
    }
    return best;
}

// Error of the light of chains of a lattice with so many halvings, relative to this light, by which they are chosen.
float planned_error(ChainLattice lattice, LatticePilot pilot, uint halvings) {
    return own_error(lattice, pilot, halvings, light_halvings_for(lattice, pilot, halvings), EXPECTED_DIRECTION_ERROR);
}

// Halvings that cells of another kind have less: at least so many, and as many as let their rays be no more than those near landings, or a
// multiple of these where few pilot rays land.
uint halvings_less(uint least, float cells, LatticePilot pilot) {
    float most = float(pilot.near_landings) * max(MANY_LANDINGS / float(pilot.landings), 1.0);
    return max(least, uint(max(ceil(log2(cells / most)), 0.0)));
}

// Those of cells near chains that land nowhere, and of cells near no chain, in a lattice or a group of lattices with so many cells. Few of them
// hold light that lands, but some do: their rays are spread more widely, not left out, so that no light is lost.
uvec2 less_by_kind(LatticePilot pilot, float cells) {
    // The balance of flux counts light that does not land, too. With a number of samples, and on meshes, where a landing costs more than
    // a ray, an even lattice has fewer wide landings.
    if (COUNTS_FLUX) return uvec2(0);
    if (HAS_ATLAS) return uvec2(0);
    if (push.error == 0.0) return uvec2(0);
    if (pilot.near_landings == 0) return uvec2(LESS_NEAR_CHAINS, LESS_ELSEWHERE);
    float elsewhere = cells - float(pilot.near_chains) - float(pilot.near_landings);
    return uvec2(halvings_less(LESS_NEAR_CHAINS, float(pilot.near_chains), pilot), halvings_less(LESS_ELSEWHERE, elsewhere, pilot));
}

// Number of rays of a lattice.
float ray_count(ChainLattice lattice, LatticePilot pilot, LatticePlan plan) {
    if (plan.halvings == NO_RAYS) return 0.0;
    float count = 0.0;
    uint counts[3] = uint[](lattice.columns * lattice.rows - pilot.near_chains - pilot.near_landings, pilot.near_chains, pilot.near_landings);
    for (uint kind = 0; kind < 3; kind++) count += float(counts[kind]) * exp2(float(cell_halvings(plan, kind)));
    return count * float(plan.bands);
}

// Number of footprints of a lattice, about: one for each part of the spectrum of each ray that lands.
float footprint_count(LatticePilot pilot, LatticePlan plan) {
    if (plan.halvings == NO_RAYS) return 0.0;
    // The footprints of pieces of the light are narrower than the pilot's, by up to the share of a piece.
    float parts = pilot.parts * exp2(float(plan.light_halvings));
    return exp2(float(plan.halvings)) * (float(plan.bands * pilot.landings) + parts);
}

void add(inout Group group, Group other) {
    group.pilot.chains += other.pilot.chains;
    group.pilot.landings += other.pilot.landings;
    group.pilot.near_landings += other.pilot.near_landings;
    group.pilot.near_chains += other.pilot.near_chains;
    group.pilot.flux += other.pilot.flux;
    group.pilot.incoherent += other.pilot.incoherent;
    group.cells += other.cells;
    group.share += other.share;
}

// The share of a lattice's light of chains in the light of each receiver, added up. `all`: light that lands on all receivers, W.
float share_of(uint number, float all) {
    float share = 0.0;
    for (uint receiver = 0; receiver < receivers(); receiver++) {
        share += lattice_fluxes[number * receivers() + receiver].z / max(max(landed[receiver % SPLAT_GROUP].x, DIM_RECEIVER * all), 1e-30);
    }
    return share;
}

const Group NOTHING = Group(LatticePilot(0, 0, 0, 0, vec2(0.0), 0.0, 0.0, 0.0, 0.0), 0.0, 0.0);

// The group of lattices that begins with number `first`. All threads call it.
Group group_at(uint first, float all) {
    Group group = NOTHING;
    uint end = first + lattices[first].group_size;
    for (uint i = first + gl_LocalInvocationIndex; i < end; i += SPLAT_GROUP) {
        add(group, Group(lattice_pilots[i], float(lattices[i].columns * lattices[i].rows), share_of(i, all)));
    }
    barrier(); // the threads have read the group before
    groups[gl_LocalInvocationIndex] = group;
    barrier();
    group = NOTHING;
    for (uint i = 0; i < SPLAT_GROUP; i++) add(group, groups[i]);
    return group;
}

// How often the cells of the lattices of a group are to be halved where its chains have `share` of the light of their receivers. All alike,
// whatever the pilot rays of one of them found: lattices that were refined only where a ray had found chains would miss the others'.
uint halvings_for(ChainLattice lattice, LatticePilot pilot, float cells, float share) {
    // The light of a single surface is part of the balance of flux.
    if (pilot.chains == 0) {
        if (COUNTS_FLUX) return 0;
        return NO_RAYS;
    }
    if (push.error > 0.0) {
        uint most = 2 * lattice.refinements + MORE_HALVINGS;
        float others = max(1.0 - share, 0.0);
        float allowed = push.error * max(MAX_ADDED, sqrt(1.0 - others * others));
        uint halvings = 0;
        for (; halvings < most && share * planned_error(lattice, pilot, halvings) > allowed; halvings++) {
            // Others would give up their rays for those that there can be no room for.
            if (exp2(float(halvings + 1)) * float(pilot.landings) > float(MAX_RAYS)) break;
        }
        return halvings;
    }
    // As many rays land as the lattice would have, if all of them landed.
    float needed = exp2(2.0 * float(lattice.refinements)) * cells * min(share * share / (MAX_ADDED * MAX_ADDED), 1.0);
    return uint(clamp(ceil(log2(needed / max(float(pilot.landings), UNSEEN))), 0.0, 2.0 * float(lattice.refinements)));
}

// Bands of the spectrum that the rays of a lattice carry one each, so that what lands is dispersed by at most this many standard
// deviations of the footprint within a band: over a band, places are linear in the index of refraction.
const float MAX_DISPERSED = 6.0;

uint bands_for(LatticePilot pilot, uint light_halvings) {
    float bands = 1.0;
    if (DISPERSES) bands = clamp(ceil(pilot.dispersed * exp2(float(light_halvings)) / MAX_DISPERSED), 1.0, float(MAX_BANDS));
    return uint(bands);
}

// More than there are halvings. Lattices that give up so many give up the bands of the spectrum, too: there is room for one ray per cell.
const uint MOST_GIVEN_UP = 31;

// The plan of a lattice where those with the most halvings, `most`, give up so many of them. Others have few rays, which would make no room.
LatticePlan with_fewer(LatticePlan plan, uint most, uint fewer) {
    if (plan.halvings == NO_RAYS) return plan;
    plan.halvings = min(plan.halvings, most - min(fewer, most));
    plan.light_halvings = min(plan.light_halvings, plan.halvings / 2);
    if (fewer == MOST_GIVEN_UP) plan.bands = 1;
    return plan;
}

// The halvings that are given up, so that there is room for all rays and footprints. All threads call it.
uint given_up(uint most) {
    memoryBarrierBuffer();
    barrier(); // the plans are written
    for (uint fewer = 0; fewer < MOST_GIVEN_UP; fewer++) {
        vec2 count = vec2(0.0);
        for (uint i = gl_LocalInvocationIndex; i < push.lattice_count; i += SPLAT_GROUP) {
            LatticePlan plan = with_fewer(lattice_plans[i], most, fewer);
            count += vec2(ray_count(lattices[i], lattice_pilots[i], plan), footprint_count(lattice_pilots[i], plan));
        }
        barrier(); // the threads have read the counts before
        counts[gl_LocalInvocationIndex] = count;
        barrier();
        count = vec2(0.0);
        for (uint i = 0; i < SPLAT_GROUP; i++) count += counts[i];
        if (count.x <= float(push.ray_capacity) && count.y <= MAX_FILLED * float(push.splat_capacity)) return fewer;
    }
    return MOST_GIVEN_UP;
}

// One workgroup.
void main() {
    uint own = gl_LocalInvocationIndex;
    vec2 sum = vec2(0.0);
    for (uint receiver = own; receiver < receivers(); receiver += SPLAT_GROUP) {
        for (uint i = 0; i < push.lattice_count; i++) sum += lattice_fluxes[i * receivers() + receiver].xy;
        chain_errors[receiver] = vec2(0.0);
    }
    landed[own] = sum;
    barrier();
    vec2 all = vec2(0.0);
    for (uint i = 0; i < SPLAT_GROUP; i++) all += landed[i];
    // The share of all light that a group may bring without a pilot ray that says so.
    float unseen = UNSEEN / max(all.y, 1.0);
    uint most = 0; // halvings
    uint next = 0;
    for (uint first = 0; first < push.lattice_count; first = next) {
        ChainLattice lattice = lattices[first];
        next = first + lattice.group_size;
        Group group = group_at(first, all.x);
        float share = group.pilot.landings == 0 ? unseen : group.share;
        uint halvings = halvings_for(lattice, group.pilot, group.cells / float(lattice.group_size), share);
        if (halvings != NO_RAYS) most = max(most, halvings);
        uvec2 less = less_by_kind(group.pilot, group.cells);
        for (uint i = first + own; i < next; i += SPLAT_GROUP) {
            lattice_plans[i] = LatticePlan(halvings, bands_for(lattice_pilots[i], 0), 0, less.x, less.y);
        }
    }
    // The pieces of the light are those that suit the rays for which there is room, and their footprints need room, too.
    uint fewer = given_up(most);
    for (uint first = 0; first < push.lattice_count; first = next) {
        next = first + lattices[first].group_size;
        LatticePlan plan = with_fewer(lattice_plans[first], most, fewer);
        if (plan.halvings == NO_RAYS) continue;
        uint of_light = light_halvings_for(lattices[first], group_at(first, all.x).pilot, plan.halvings);
        for (uint i = first + own; i < next; i += SPLAT_GROUP) {
            lattice_plans[i].light_halvings = of_light;
            lattice_plans[i].bands = bands_for(lattice_pilots[i], of_light);
        }
    }
    fewer = given_up(most);
    for (uint first = 0; first < push.lattice_count; first = next) {
        next = first + lattices[first].group_size;
        LatticePlan plan = with_fewer(lattice_plans[first], most, fewer);
        if (plan.halvings == NO_RAYS) continue;
        LatticePilot pilot = group_at(first, all.x).pilot;
        float error = own_error(lattices[first], pilot, plan.halvings, plan.light_halvings, EXPECTED_DIRECTION_ERROR);
        for (uint receiver = own; receiver < receivers(); receiver += SPLAT_GROUP) {
            float flux = 0.0;
            for (uint i = first; i < next; i++) flux += lattice_fluxes[i * receivers() + receiver].z;
            float share = pilot.landings == 0 ? unseen : flux / max(landed[receiver % SPLAT_GROUP].x, 1e-30);
            chain_errors[receiver] += share * vec2(error, 1.0);
        }
    }
    barrier(); // the plans have been read
    for (uint i = own; i < push.lattice_count; i += SPLAT_GROUP) lattice_plans[i] = with_fewer(lattice_plans[i], most, fewer);
    if (own != 0) return;
    chain_errors[receivers()] = vec2(fewer, 0.0);
}
