//! Barriers that several lists of passes have.

use crate::gpu::{Access, Recorder};

/// All accesses to device memory, on either side of a barrier.
pub const ANY: Access = Access::ANY_READ.and(Access::ANY_WRITE);
/// Accesses of a draw to a splat list.
pub const LIST_READ: Access = Access::VERTEX_READ
    .and(Access::INDEX_READ)
    .and(Access::INDIRECT_READ);

/// The barrier between two compute passes, of which the first may write the size of the second.
pub fn next(recorder: &mut Recorder) {
    recorder.barrier(
        Access::COMPUTE_WRITE,
        Access::COMPUTE.and(Access::INDIRECT_READ),
    );
}

/// The barrier after a draw of a splat list that compute passes write.
pub fn after_draw(recorder: &mut Recorder) {
    recorder.barrier(
        Access::BLEND.and(LIST_READ),
        Access::BLEND
            .and(Access::COMPUTE)
            .and(Access::TRANSFER_WRITE),
    );
}
