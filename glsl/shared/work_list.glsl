// Lists of work that a pass finds for another one. Their order is not fixed, and does not matter: every item writes texels of
// its own. The including shader declares the buffer `counts` of a work list.

// Item of this workgroup, or of this thread, counted from push.first on; workgroups of an indirect dispatch are in rows.
uint group_index() {
    return gl_WorkGroupID.y * MAX_ROW + gl_WorkGroupID.x;
}
