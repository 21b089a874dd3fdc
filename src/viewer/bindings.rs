//! Descriptor sets and shaders of the window's own passes.

use super::host::{Host, failed};
use ash::vk;
use nephroid::Result;
use nephroid::render::MapImage;

/// What the shaders of a pass see.
#[derive(Clone, Copy)]
pub struct Layout {
    pub stage: vk::ShaderStageFlags,
    /// Number of sampled images, the first bindings.
    pub images: u32,
    /// Whether a storage buffer follows them.
    pub has_buffer: bool,
    pub filter: vk::Filter,
    pub push_bytes: usize,
}

/// Descriptor sets of one layout. The host destroys them with [`Bindings::destroy`].
pub struct Bindings {
    sampler: vk::Sampler,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    /// Of the pipelines.
    pub layout: vk::PipelineLayout,
    pub sets: Vec<vk::DescriptorSet>,
}

impl Bindings {
    /// `count` sets.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn new(host: &Host, of: Layout, count: usize) -> Result<Self> {
        let device = &host.device;
        let image = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
        let kinds = std::iter::repeat_n(image, of.images as usize)
            .chain(of.has_buffer.then_some(vk::DescriptorType::STORAGE_BUFFER));
        let bindings: Vec<_> = (0..)
            .zip(kinds)
            .map(|(index, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(index)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(of.stage)
            })
            .collect();
        let sizes: Vec<_> = bindings
            .iter()
            .map(|binding| vk::DescriptorPoolSize {
                ty: binding.descriptor_type,
                descriptor_count: count as u32,
            })
            .collect();
        // SAFETY: create-infos that are valid for their calls; destroyed by the host.
        unsafe {
            let info = vk::SamplerCreateInfo::default()
                .mag_filter(of.filter)
                .min_filter(of.filter)
                .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
                .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
            let sampler =
                (device.create_sampler(&info, None)).map_err(failed("making a sampler"))?;
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layout = (device.create_descriptor_set_layout(&info, None))
                .map_err(failed("making a descriptor layout"))?;
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(count as u32)
                .pool_sizes(&sizes);
            let pool = (device.create_descriptor_pool(&info, None))
                .map_err(failed("making a descriptor pool"))?;
            let set_layouts = vec![set_layout; count];
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&set_layouts);
            let sets = (device.allocate_descriptor_sets(&info))
                .map_err(failed("allocating descriptor sets"))?;
            let ranges = [vk::PushConstantRange {
                stage_flags: of.stage,
                offset: 0,
                size: of.push_bytes as u32,
            }];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&set_layouts[..1])
                .push_constant_ranges(&ranges);
            let layout = (device.create_pipeline_layout(&info, None))
                .map_err(failed("making a pipeline layout"))?;
            Ok(Self {
                sampler,
                set_layout,
                pool,
                layout,
                sets,
            })
        }
    }

    /// Binds images, and the buffer if the layout has one. No frame in flight uses the set.
    pub fn write(&self, host: &Host, set: usize, images: &[MapImage], buffer: Option<vk::Buffer>) {
        let images: Vec<_> = images
            .iter()
            .map(|image| vk::DescriptorImageInfo {
                sampler: self.sampler,
                image_view: image.view,
                image_layout: image.layout,
            })
            .collect();
        let buffers: Vec<_> = buffer
            .into_iter()
            .map(|buffer| vk::DescriptorBufferInfo {
                buffer,
                offset: 0,
                range: vk::WHOLE_SIZE,
            })
            .collect();
        let write = vk::WriteDescriptorSet::default().dst_set(self.sets[set]);
        let mut writes = vec![
            write
                .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                .image_info(&images),
        ];
        if !buffers.is_empty() {
            writes.push(
                write
                    .dst_binding(images.len() as u32)
                    .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                    .buffer_info(&buffers),
            );
        }
        // SAFETY: the set is not in use. Consecutive bindings of a kind are written as one array.
        unsafe { host.device.update_descriptor_sets(&writes, &[]) };
    }

    /// The device must be idle.
    pub fn destroy(&self, host: &Host) {
        // SAFETY: the device is idle.
        unsafe {
            host.device.destroy_pipeline_layout(self.layout, None);
            host.device.destroy_descriptor_pool(self.pool, None);
            host.device
                .destroy_descriptor_set_layout(self.set_layout, None);
            host.device.destroy_sampler(self.sampler, None);
        }
    }
}

/// A shader of the window's own, with the SPIR-V that the build compiled.
pub struct WindowShader {
    /// Of its file in `glsl/viewer`.
    pub name: &'static str,
    pub spirv: &'static [u8],
}

impl WindowShader {
    pub fn words(&self) -> Vec<u32> {
        ash::util::read_spv(&mut std::io::Cursor::new(self.spirv)).expect("SPIR-V of the compiler")
    }

    /// The caller destroys it.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn module(&self, host: &Host) -> Result<vk::ShaderModule> {
        let words = self.words();
        #[cfg(feature = "dev")]
        let words = host.newest_shaders.get(self.name).cloned().unwrap_or(words);
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: SPIR-V of the compiler.
        unsafe { host.device.create_shader_module(&info, None) }
            .map_err(failed(&format!("loading {}", self.name)))
    }
}

/// The shader of this file.
macro_rules! window_shader {
    ($name:literal) => {
        $crate::viewer::bindings::WindowShader {
            name: $name,
            spirv: include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".spv")),
        }
    };
}
pub(super) use window_shader;
