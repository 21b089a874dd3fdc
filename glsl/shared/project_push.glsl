// The push constants of all projectors.

layout(push_constant) uniform ProjectPush {
    uint first_pair;     // of this batch; a pair is light * patch_count + patch, or one of `pairs`
    uint pair_count;     // in this batch
    uint patch_count;
    uint first_light;
    uint receiver_count; // of the kind that the projector lights
    uint lobes;          // 1: mirrored light; 2: and refracted light
    float spread;        // variance of the kernel over that of the patch
    float flat_spread;   // where the patch is flat
    uint can_occlude;    // 0: nothing can occlude light
    uint clustered;      // 1: patches are clusters of many triangles, and large; `pairs` has the light that each images
    uint product;        // 1: triangles take the area as the product of two lengths
} push;
