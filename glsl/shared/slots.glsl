// How many slots each pair uses, for compact. The including shader, of one pair a thread, declares the
// buffers `counts` and `group_counts`.

shared uvec2 group_count;

// For all threads of a workgroup together.
void count_slots(uint pair_count, uint count) {
    if (gl_GlobalInvocationID.x < pair_count) counts[gl_GlobalInvocationID.x] = count;
    if (gl_LocalInvocationIndex == 0) group_count = uvec2(0);
    barrier();
    // A sum of integers does not depend on the order, so the result is the same every time.
    atomicAdd(group_count.x, count);
    atomicAdd(group_count.y, min(count, 1));
    barrier();
    if (gl_LocalInvocationIndex == 0) group_counts[gl_WorkGroupID.x] = group_count;
}
