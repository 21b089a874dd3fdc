// Prefix sums within a workgroup of SPLAT_GROUP threads.

shared uvec2 sums[SPLAT_GROUP];

// Sum of the values of all threads before this one (Hillis & Steele 1986); `total` is the sum over all threads. All
// threads call it together.
uvec2 exclusive_sum(uvec2 value, out uvec2 total) {
    uint i = gl_LocalInvocationIndex;
    sums[i] = value;
    barrier();
    for (uint stride = 1; stride < SPLAT_GROUP; stride *= 2) {
        uvec2 before = i >= stride ? sums[i - stride] : uvec2(0);
        barrier();
        sums[i] += before;
        barrier();
    }
    total = sums[SPLAT_GROUP - 1];
    uvec2 result = sums[i] - value;
    barrier();
    return result;
}
