//! Words that a frame copies to the host, which reads them when the frame has ended.

use super::{Buffer, Context, Recorder};
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// A buffer that the host reads.
pub struct Readback(Buffer);

impl Readback {
    /// A buffer for `words` words of 4 bytes.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the memory is insufficient.
    pub fn new(context: &Arc<Context>, words: usize) -> Result<Self> {
        Ok(Self(Buffer::readback(context, 4 * words as u64)?))
    }

    /// Number of words that it holds.
    pub fn capacity(&self) -> usize {
        self.0.bytes as usize / 4
    }

    /// The first `count` words. The frame that wrote them has ended.
    pub fn words(&mut self, count: usize) -> Vec<u32> {
        bytemuck::pod_collect_to_vec(&self.0.mapped()[..4 * count])
    }
}

impl Recorder {
    /// Copies the first `count` words of a buffer to those of `to` from number `first` on.
    pub fn copy_words(&mut self, from: &Buffer, to: &Readback, first: usize, count: usize) {
        assert!(first + count <= to.capacity() && 4 * count as u64 <= from.bytes);
        let region = vk::BufferCopy::default()
            .dst_offset(4 * first as u64)
            .size(4 * count as u64);
        self.copy_buffer(from.handle, to.0.handle, region);
    }
}
