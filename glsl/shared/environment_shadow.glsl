// What the rays of a texel found between it and the environment, as one number: a bit for each group of cells that is in shadow,
// and the share of the light that is, after the point. A float has room for both.

// A texel without any light, such as one under an object that stands on the rect.
const float NO_LIGHT = -1.0;
const float MOST_OF_SHARE = 0.99;
const uint ALL_GROUPS = (1u << DIRECT_CELL_GROUPS) - 1u;

float shadow_of(uint groups, float share) {
    return float(groups) + MOST_OF_SHARE * share;
}

uint groups_in(float shadow) {
    return shadow == NO_LIGHT ? ALL_GROUPS : uint(shadow);
}

float share_in(float shadow) {
    return fract(shadow) / MOST_OF_SHARE;
}

// What the rays of several texels have in common.
struct Shadows {
    uint all;        // groups that are in shadow at all of them
    uint any;        // at one or several of them
    uint count;      // number of the texels
};

void include(inout Shadows shadows, float shadow) {
    shadows.all &= groups_in(shadow);
    shadows.any |= groups_in(shadow);
    shadows.count++;
}
