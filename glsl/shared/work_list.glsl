// Lists of work that a pass finds for another one. Their order is not fixed, and does not matter: every item writes texels of
// its own. The including shader declares the buffer `counts` of a work list.

// Number of this workgroup; those of an indirect dispatch are in rows.
uint group_index() {
    return gl_WorkGroupID.y * MAX_ROW + gl_WorkGroupID.x;
}
