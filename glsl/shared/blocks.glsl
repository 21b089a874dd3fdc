// Prefix sums in two levels: number.comp within blocks of SPLAT_GROUP, scan.comp over the blocks. Later passes search
// both. Also the numbering of threads in a dispatch of several rows of workgroups.

uint thread_index() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * SPLAT_GROUP + gl_LocalInvocationIndex;
}

// The last of `count` prefix sums, from `first` on, that is at most `value`: the unit that contains it. `SUM(i)` is the
// i-th prefix sum.
#define SEARCH(found, first, count, value, SUM)            \
    uint found = first;                                    \
    for (uint end_ = (first) + (count); end_ - found > 1;) { \
        uint half_way_ = (found + end_) / 2;               \
        if (SUM(half_way_) <= value) found = half_way_; else end_ = half_way_; \
    }
