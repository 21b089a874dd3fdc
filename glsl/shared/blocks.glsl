// Prefix sums in two levels: number.comp within blocks of SPLAT_GROUP, scan.comp over the blocks. Later passes search
// both. Also the numbering of threads in a dispatch of several rows of workgroups.

uint thread_index() {
    return (gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * SPLAT_GROUP + gl_LocalInvocationIndex;
}

#include "search.glsl"
