// Counts the slots that each pair uses, for compact.comp. The including shader runs one thread per pair and declares
// the buffers `counts` and `group_counts`.

shared uvec2 group_count;

// All threads of a workgroup call this together.
void count_slots(uint pair_count, uint count) {
    if (gl_GlobalInvocationID.x < pair_count) counts[gl_GlobalInvocationID.x] = count;
    if (gl_LocalInvocationIndex == 0) group_count = uvec2(0);
    barrier();
    // Integer sums do not depend on the order, so the result is deterministic.
    atomicAdd(group_count.x, count);
    atomicAdd(group_count.y, min(count, 1));
    barrier();
    if (gl_LocalInvocationIndex == 0) group_counts[gl_WorkGroupID.x] = group_count;
}
