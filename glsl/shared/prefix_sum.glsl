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

// Replaces `count_` sums of blocks in the buffer `block_sums` by their prefix sums; `total_` becomes their sum. All threads of the
// one workgroup run it.
#define SCAN_BLOCKS(block_sums, count_, total_)                                                     \
    uvec2 total_ = uvec2(0);                                                                        \
    for (uint first_ = 0; first_ < (count_); first_ += SPLAT_GROUP) {                               \
        uint block_ = first_ + gl_LocalInvocationIndex;                                             \
        uvec2 of_blocks_;                                                                           \
        uvec2 sum_ = exclusive_sum(block_ < (count_) ? block_sums[block_] : uvec2(0), of_blocks_);  \
        if (block_ < (count_)) block_sums[block_] = total_ + sum_;                                  \
        total_ += of_blocks_;                                                                       \
    }
