//! Host memory from which buffers and images are filled.

use super::image::image_copy;
use super::memory::{Buffer, Owned};
use super::texel::{Colour, LIGHT_BYTES, Texel};
use super::{Access, Context, Image, Recorder};
use crate::error::Result;
use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// A copy that the next recording does.
enum Copy {
    ToBuffer {
        from: vk::Buffer,
        to: Arc<Owned>,
        region: vk::BufferCopy,
    },
    ToImage {
        from: vk::Buffer,
        to: Arc<Owned>,
        region: vk::BufferImageCopy,
    },
    /// Later copies overwrite what earlier ones wrote.
    Barrier,
}

/// Host memory from which buffers and images are filled. It has a slot for each frame in flight, since the
/// device may still read what earlier frames wrote.
pub struct Staging {
    context: Arc<Context>,
    /// By slot, buffers of which the last one is being filled.
    slots: Vec<Vec<Buffer>>,
    current: usize,
    /// Bytes in use of the current slot's last buffer.
    used: u64,
    /// Whether the current slot's copies have been recorded, so that the next write takes the next slot.
    is_recorded: bool,
    /// Recordings since the last copy.
    idle: usize,
    copies: Vec<Copy>,
    /// Images without a layout.
    new_images: Vec<(Arc<Owned>, vk::ImageSubresourceRange)>,
    /// What the last recording did.
    last_copies: Vec<Copy>,
    last_images: Vec<(Arc<Owned>, vk::ImageSubresourceRange)>,
}

impl Staging {
    /// Bytes of the smallest buffer.
    const LEAST: u64 = 1 << 16;
    /// Of offsets: a texel.
    const ALIGNMENT: u64 = LIGHT_BYTES;

    /// For at most `frames` frames in flight.
    pub fn new(context: &Arc<Context>, frames: u32) -> Self {
        Self {
            context: context.clone(),
            slots: (0..frames.max(1)).map(|_| Vec::new()).collect(),
            current: 0,
            used: 0,
            is_recorded: false,
            idle: 0,
            copies: Vec::new(),
            new_images: Vec::new(),
            last_copies: Vec::new(),
            last_images: Vec::new(),
        }
    }

    /// Begins writes that may overwrite earlier ones, which were not recorded yet.
    pub fn begin(&mut self) {
        if !self.copies.is_empty() {
            self.copies.push(Copy::Barrier);
        }
    }

    /// Writes `data` to a buffer from element `first` on.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the write reaches beyond the buffer.
    pub fn write<T: Pod>(&mut self, to: &Buffer, first: usize, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let offset = (first * size_of::<T>()) as u64;
        assert!(offset + bytes.len() as u64 <= to.bytes);
        if bytes.is_empty() {
            return Ok(());
        }
        let (from, start) = self.place(bytes.len() as u64)?;
        self.fill(start, bytes);
        self.copies.push(Copy::ToBuffer {
            from,
            to: to.owned.clone(),
            region: vk::BufferCopy {
                src_offset: start,
                dst_offset: offset,
                size: bytes.len() as u64,
            },
        });
        Ok(())
    }

    /// Writes a mip level of an image, RGB.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the level has another number of texels.
    pub fn write_level(&mut self, to: &Image, level: u32, rgb: &[[f32; 3]]) -> Result<()> {
        let [width, height] = [to.width, to.height].map(|side| (side >> level).max(1));
        assert_eq!(rgb.len() as u64, u64::from(width) * u64::from(height));
        let (from, start) = self.place(rgb.len() as u64 * LIGHT_BYTES)?;
        let texels: Vec<[f32; 4]> = rgb.iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
        self.fill(start, bytemuck::cast_slice(&texels));
        self.copies.push(Copy::ToImage {
            from,
            to: to.owned.clone(),
            region: image_copy(level, [0, 0], [width, height]).buffer_offset(start),
        });
        Ok(())
    }

    /// Writes the texels of a rectangle of an image of [`Texel::Colour`], row by row.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the rectangle has another number of texels.
    pub fn write_colours(
        &mut self,
        to: &Image,
        origin: [u32; 2],
        size: [u32; 2],
        colours: &[Colour],
    ) -> Result<()> {
        assert_eq!(to.texel, Texel::Colour);
        assert_eq!(
            colours.len() as u64,
            u64::from(size[0]) * u64::from(size[1])
        );
        let (from, start) = self.place(size_of_val(colours) as u64)?;
        self.fill(start, bytemuck::cast_slice(colours));
        self.copies.push(Copy::ToImage {
            from,
            to: to.owned.clone(),
            region: image_copy(0, origin, size).buffer_offset(start),
        });
        Ok(())
    }

    /// Has the next recording bring a new image into its layout.
    pub fn prepare(&mut self, image: &Image) {
        self.new_images.push((image.owned.clone(), image.range()));
    }

    /// Where so many bytes go.
    fn place(&mut self, bytes: u64) -> Result<(vk::Buffer, u64)> {
        if std::mem::take(&mut self.is_recorded) {
            self.current = (self.current + 1) % self.slots.len();
            let slot = &mut self.slots[self.current];
            // The last one is the largest, and soon large enough for all.
            slot.drain(..slot.len().saturating_sub(1));
            self.used = 0;
        }
        let slot = &mut self.slots[self.current];
        let start = self.used.next_multiple_of(Self::ALIGNMENT);
        if slot.last().is_none_or(|last| start + bytes > last.bytes()) {
            let last = slot.last().map_or(0, Buffer::bytes);
            let size = bytes.max(2 * last).max(Self::LEAST);
            let location = MemoryLocation::CpuToGpu;
            slot.push(Buffer::allocate(&self.context, "staging", size, location)?);
            self.used = bytes;
            return Ok((slot[slot.len() - 1].handle, 0));
        }
        self.used = start + bytes;
        Ok((slot[slot.len() - 1].handle, start))
    }

    fn fill(&mut self, start: u64, bytes: &[u8]) {
        let buffer = self.slots[self.current].last_mut().expect("just placed");
        buffer.mapped()[start as usize..][..bytes.len()].copy_from_slice(bytes);
    }

    /// The last recording is not submitted: the next one does its copies.
    pub fn forget_last(&mut self) {
        // If there were writes since, the last recording was that of an earlier frame.
        if std::mem::take(&mut self.is_recorded) {
            std::mem::swap(&mut self.copies, &mut self.last_copies);
            std::mem::swap(&mut self.new_images, &mut self.last_images);
        }
    }

    /// Records the copies. The caller has them wait for whoever used the targets before, and makes them visible.
    pub fn record(&mut self, recorder: &mut Recorder) {
        self.idle = if self.copies.is_empty() {
            self.idle + 1
        } else {
            0
        };
        if self.idle == self.slots.len() {
            // What stands still needs none of the memory.
            self.slots.iter_mut().for_each(Vec::clear);
        }
        self.last_copies.clear();
        self.last_images.clear();
        std::mem::swap(&mut self.copies, &mut self.last_copies);
        std::mem::swap(&mut self.new_images, &mut self.last_images);
        // What nobody else holds was dropped since.
        let is_held = |owned: &Arc<Owned>| Arc::strong_count(owned) > 1;
        for (image, range) in self.last_images.iter().filter(|(image, _)| is_held(image)) {
            recorder.begin_general(image.image, *range);
        }
        for copy in &self.last_copies {
            match copy {
                Copy::ToBuffer { from, to, region } if is_held(to) => {
                    recorder.copy_buffer(*from, to.buffer, *region);
                }
                Copy::ToImage { from, to, region } if is_held(to) => {
                    recorder.copy_to_image(*from, to.image, *region);
                }
                Copy::ToBuffer { .. } | Copy::ToImage { .. } => {}
                Copy::Barrier => {
                    recorder.barrier(Access::TRANSFER_WRITE, Access::TRANSFER_WRITE);
                }
            }
        }
        self.is_recorded = true;
    }
}
