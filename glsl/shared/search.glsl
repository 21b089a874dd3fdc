// The last of `count` prefix sums, from `first` on, that is at most `value`: the unit that contains it. `SUM(i)` is the
// i-th prefix sum.
#define SEARCH(found, first, count, value, SUM)            \
    uint found = first;                                    \
    for (uint end_ = (first) + (count); end_ - found > 1;) { \
        uint half_way_ = (found + end_) / 2;               \
        if (SUM(half_way_) <= value) found = half_way_; else end_ = half_way_; \
    }
