//! Adds up the differences of two sides on the device: of their pictures and of their light maps.

use super::bindings::{Bindings, Layout, WindowShader, window_shader};
use super::compare::Difference;
use super::host::{Host, failed};
use super::side::Maps;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use nephroid::Result;

pub static SHADER: WindowShader = window_shader!("differences.comp");

/// Constants of `glsl/viewer/constants.glsl`, made by build.rs.
pub mod constants {
    include!(concat!(env!("OUT_DIR"), "/viewer_constants.rs"));
}

/// The layout of `glsl/viewer/differences.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    origin_a: [u32; 2],
    origin_b: [u32; 2],
    size: [u32; 2],
    first: u32,
    is_relative: u32,
}

/// A workgroup's sums: |A − B|, B, squared differences, A.
type Sums = [f32; 4];

/// A rectangle of both sides.
struct Region {
    /// Object whose light map it is; `None`: the picture.
    receiver: Option<usize>,
    origins: [[u32; 2]; 2],
    size: [u32; 2],
}

impl Region {
    /// Workgroups along both sides.
    fn groups(&self) -> [u32; 2] {
        self.size.map(|side| side.div_ceil(constants::BLOCK_SIDE))
    }
}

/// What a frame in flight adds up.
#[derive(Default)]
struct Slot {
    buffer: Option<(vk::Buffer, Allocation)>,
    /// Those that were recorded and not read.
    regions: Vec<Region>,
}

/// The host destroys it with [`Differences::destroy`].
pub struct Differences {
    /// Two sets for each frame in flight: pictures and light maps.
    bindings: Bindings,
    pipeline: vk::Pipeline,
    slots: Vec<Slot>,
}

impl Differences {
    /// For frames of which `frames` are in flight.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn new(host: &Host, frames: usize) -> Result<Self> {
        let stage = vk::ShaderStageFlags::COMPUTE;
        let layout = Layout {
            stage,
            images: 2,
            has_buffer: true,
            filter: vk::Filter::NEAREST,
            push_bytes: size_of::<Push>(),
        };
        let bindings = Bindings::new(host, layout, 2 * frames)?;
        let device = &host.device;
        let module = SHADER.module(host)?;
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(
                vk::PipelineShaderStageCreateInfo::default()
                    .stage(stage)
                    .module(module)
                    .name(c"main"),
            )
            .layout(bindings.layout);
        // SAFETY: module and layout are of this device; the module is not needed afterwards.
        let made = unsafe {
            let made = device.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
            device.destroy_shader_module(module, None);
            made
        };
        Ok(Self {
            bindings,
            pipeline: made.map_err(|(_, error)| failed("compiling a pipeline")(error))?[0],
            slots: (0..frames).map(|_| Slot::default()).collect(),
        })
    }

    /// Records the sums over what both sides rendered. The images are readable, and the slot's last frame has ended.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where there is not enough memory.
    pub fn record(
        &mut self,
        host: &Host,
        commands: vk::CommandBuffer,
        slot: usize,
        [a, b]: [&Maps; 2],
        is_relative: bool,
    ) -> Result<()> {
        let picture = Region {
            receiver: None,
            origins: [[0; 2]; 2],
            size: [0, 1].map(|axis| a.picture.size[axis].min(b.picture.size[axis])),
        };
        // Both sides have the same scene, and so the same receivers in the same order.
        let light_maps = a.receivers.iter().zip(&b.receivers).map(|(a, b)| Region {
            receiver: Some(a.object),
            origins: [a.light.origin, b.light.origin],
            size: a.light.size,
        });
        let regions: Vec<Region> = std::iter::once(picture).chain(light_maps).collect();
        let groups = regions.iter().map(|region| region.groups());
        let count: u64 = groups.map(|[x, y]| u64::from(x) * u64::from(y)).sum();
        let buffer = self.slots[slot].sized(host, count * size_of::<Sums>() as u64)?;
        let sets = [2 * slot, 2 * slot + 1];
        let images = [[a.picture, b.picture], [a.light_map, b.light_map]];
        for (set, images) in sets.into_iter().zip(images) {
            self.bindings.write(host, set, &images, Some(buffer));
        }
        let (device, layout) = (&host.device, self.bindings.layout);
        let point = vk::PipelineBindPoint::COMPUTE;
        let mut first = 0;
        // SAFETY: the command buffer is recording, and the sets are bound to what lives as long as the frame.
        unsafe {
            device.cmd_bind_pipeline(commands, point, self.pipeline);
            for region in &regions {
                let set = self.bindings.sets[sets[usize::from(region.receiver.is_some())]];
                let push = Push {
                    origin_a: region.origins[0],
                    origin_b: region.origins[1],
                    size: region.size,
                    first,
                    is_relative: is_relative.into(),
                };
                let stages = vk::ShaderStageFlags::COMPUTE;
                let [x, y] = region.groups();
                device.cmd_bind_descriptor_sets(commands, point, layout, 0, &[set], &[]);
                device.cmd_push_constants(commands, layout, stages, 0, bytemuck::bytes_of(&push));
                device.cmd_dispatch(commands, x, y, 1);
                first += x * y;
            }
            let to_host = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COMPUTE_SHADER)
                .src_access_mask(vk::AccessFlags2::SHADER_STORAGE_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                .dst_access_mask(vk::AccessFlags2::HOST_READ)];
            let dependency = vk::DependencyInfo::default().memory_barriers(&to_host);
            device.cmd_pipeline_barrier2(commands, &dependency);
        }
        self.slots[slot].regions = regions;
        Ok(())
    }

    /// Whether there are sums that were not read.
    pub fn are_pending(&self) -> bool {
        self.slots.iter().any(|slot| !slot.regions.is_empty())
    }

    /// The differences of a slot whose frame has ended, the picture's first; `None` if there is nothing new.
    pub fn read(&mut self, slot: usize) -> Option<Vec<Difference>> {
        let slot = &mut self.slots[slot];
        let regions = std::mem::take(&mut slot.regions);
        let (_, memory) = slot.buffer.as_ref()?;
        let mut sums = memory.mapped_slice()?.chunks_exact(size_of::<Sums>());
        let differences = regions.iter().map(|region| {
            let [x, y] = region.groups();
            let mut total = [0.0f64; 4];
            for group in sums.by_ref().take(x as usize * y as usize) {
                let group: Sums = bytemuck::pod_read_unaligned(group);
                total
                    .iter_mut()
                    .zip(group)
                    .for_each(|(sum, value)| *sum += f64::from(value));
            }
            let texels = region.size.map(f64::from);
            Difference::of(region.receiver, total, texels[0] * texels[1])
        });
        let differences: Vec<_> = differences.collect();
        (!differences.is_empty()).then_some(differences)
    }

    /// The device must be idle.
    pub fn destroy(&mut self, host: &Host) {
        for slot in &mut self.slots {
            slot.free(host);
        }
        // SAFETY: the device is idle.
        unsafe { host.device.destroy_pipeline(self.pipeline, None) };
        self.bindings.destroy(host);
    }
}

impl Slot {
    /// Its buffer of at least so many bytes. The slot's last frame has ended.
    fn sized(&mut self, host: &Host, bytes: u64) -> Result<vk::Buffer> {
        if let Some((buffer, memory)) = &self.buffer
            && memory.size() >= bytes
        {
            return Ok(*buffer);
        }
        self.free(host);
        // Memory is handed out in larger pieces than the smallest buffers.
        let bytes = bytes.next_power_of_two().max(4096);
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let made = host.buffer("differences", bytes, usage, MemoryLocation::GpuToCpu)?;
        Ok(self.buffer.insert(made).0)
    }

    fn free(&mut self, host: &Host) {
        if let Some(buffer) = self.buffer.take() {
            host.free_buffer(buffer);
        }
    }
}
