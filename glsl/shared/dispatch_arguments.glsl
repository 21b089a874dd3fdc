// Writes the VkDispatchIndirectCommand of `groups_` workgroups to the words of `buffer_` from `at_` on, in rows
// of MAX_ROW workgroups.
#define WRITE_DISPATCH(buffer_, at_, groups_)                      \
    {                                                              \
        uint count_ = groups_;                                     \
        buffer_[at_] = min(count_, MAX_ROW);                       \
        buffer_[(at_) + 1] = (count_ + MAX_ROW - 1) / MAX_ROW;     \
        buffer_[(at_) + 2] = 1;                                    \
    }
// The same for a thread for each of `threads_`, in workgroups of SPLAT_GROUP.
#define WRITE_DISPATCH_OF(buffer_, at_, threads_) WRITE_DISPATCH(buffer_, at_, ((threads_) + SPLAT_GROUP - 1) / SPLAT_GROUP)
// Writes the VkDrawIndexedIndirectCommand of `quads_` quads.
#define WRITE_DRAW(buffer_, at_, quads_)                           \
    {                                                              \
        buffer_[at_] = 6 * (quads_); /* indices */                 \
        buffer_[(at_) + 1] = 1;      /* instances */               \
        buffer_[(at_) + 2] = 0;                                    \
        buffer_[(at_) + 3] = 0;                                    \
        buffer_[(at_) + 4] = 0;                                    \
    }
