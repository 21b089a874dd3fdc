// The push constants of all projectors.

layout(push_constant) uniform ProjectPush {
    uint first_pair;     // first pair of this batch; pair = light * patch_count + patch, or for an environment an index into `pairs`
    uint pair_count;     // number of pairs in this batch
    uint patch_count;
    uint receiver_count; // receivers of the kind that the projector lights
    uint lobes;          // 1: reflected light; 2: also refracted light
    float spread;        // variance of the kernel over the variance of the patch
    float flat_spread;   // the same for flat patches
    uint can_occlude;    // 0: nothing can occlude light, so that no rays are traced
} push;
