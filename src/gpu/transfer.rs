//! Copies between host and device that wait for the device.

use super::image::image_copy;
use super::texel::LIGHT_BYTES;
use super::{Access, Buffer, Context, Image, Recorder, Staging};
use crate::error::Result;
use ash::vk;
use bytemuck::Pod;
use std::sync::Arc;

/// Bytes of an image that one submission copies to the host, or one row.
const BAND_BYTES: u64 = 64 << 20;

impl Buffer {
    /// A buffer with `data` in it. Waits for the device.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn with_data<T: Pod>(context: &Arc<Context>, name: &str, data: &[T]) -> Result<Self> {
        let buffer = Self::new(context, name, size_of_val(data) as u64)?;
        let mut staging = Staging::new(context, 1);
        staging.write(&buffer, 0, data)?;
        let mut recorder = Recorder::new(context)?;
        staging.record(&mut recorder);
        recorder.barrier(Access::TRANSFER_WRITE, Access::ANY_READ);
        recorder.submit()?;
        Ok(buffer)
    }

    /// Copies the buffer's first `count` elements to the host. Waits for the device.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the buffer holds fewer.
    pub fn read<T: Pod>(&self, count: usize) -> Result<Vec<T>> {
        Recorder::new(&self.owned.context)?.read(self, count)
    }
}

impl Recorder {
    /// Submits what was recorded with a copy of a buffer's first `count` elements to the host, and waits.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    ///
    /// # Panics
    /// Where the buffer holds fewer.
    pub fn read<T: Pod>(&mut self, buffer: &Buffer, count: usize) -> Result<Vec<T>> {
        let bytes = (count as u64)
            .checked_mul(size_of::<T>() as u64)
            .filter(|bytes| *bytes <= buffer.bytes)
            .unwrap_or_else(|| {
                let element = size_of::<T>();
                let bytes = buffer.bytes;
                panic!("{count} elements of {element} bytes are read from a buffer of {bytes}")
            });
        let mut readback = match self.readback.take() {
            Some(readback) if readback.bytes >= bytes => readback,
            _ => Buffer::readback(&self.context, bytes)?,
        };
        self.barrier(Access::ANY_WRITE, Access::TRANSFER_READ);
        let region = vk::BufferCopy::default().size(bytes);
        self.copy_buffer(buffer.handle, readback.handle, region);
        self.barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
        self.submit()?;
        let elements = bytemuck::pod_collect_to_vec(&readback.mapped()[..bytes as usize]);
        self.readback = Some(readback);
        Ok(elements)
    }
}

impl Image {
    /// Copies a rectangle of level 0 to the host, RGBA, rows from the top. Waits for the device.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the rectangle is empty or reaches beyond the image.
    pub fn read(&self, offset: [u32; 2], extent: [u32; 2]) -> Result<Vec<[f32; 4]>> {
        let size = [self.width, self.height];
        let inside = |axis: usize| {
            extent[axis] > 0
                && (offset[axis].checked_add(extent[axis])).is_some_and(|end| end <= size[axis])
        };
        assert!(
            inside(0) && inside(1),
            "{extent:?} texels at {offset:?} are read from an image of {size:?}"
        );
        let row_bytes = u64::from(extent[0]) * LIGHT_BYTES;
        // No submission runs long, and the host's part of the memory stays small.
        let rows = ((BAND_BYTES / row_bytes) as u32).clamp(1, extent[1]);
        let context = &self.owned.context;
        let mut host = Buffer::readback(context, row_bytes * u64::from(rows))?;
        let mut recorder = Recorder::new(context)?;
        let mut texels = Vec::with_capacity(extent[0] as usize * extent[1] as usize);
        for first in (0..extent[1]).step_by(rows as usize) {
            let band = [extent[0], rows.min(extent[1] - first)];
            recorder.barrier(Access::ANY_WRITE, Access::TRANSFER_READ);
            let region = image_copy(0, [offset[0], offset[1] + first], band);
            recorder.copy_from_image(self.handle, host.handle, region);
            recorder.barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
            recorder.submit()?;
            let bytes = row_bytes as usize * band[1] as usize;
            texels.extend(bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(
                &host.mapped()[..bytes],
            ));
        }
        Ok(texels)
    }
}
