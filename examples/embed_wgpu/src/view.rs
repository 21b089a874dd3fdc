//! wgpu's part: wraps the light map as a texture, draws the floor with it, and reads textures back.

use crate::Result;
use crate::host::Host;
use nephroid::render::{MapImage, ReceiverTile};
use wgpu::hal::{self, api::Vulkan, vulkan::TextureMemory};
use wgpu::{TextureFormat, TextureUsages, TextureUses};

pub const PICTURE: [u32; 2] = [768, 768];

/// wgpu's name for `MapImage::layout`, which is GENERAL.
pub const GENERAL: TextureUses = TextureUses::STORAGE_READ_WRITE;

fn extent([width, height]: [u32; 2]) -> wgpu::Extent3d {
    wgpu::Extent3d {
        width,
        height,
        depth_or_array_layers: 1,
    }
}

fn describe(
    size: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::TextureDescriptor<'static> {
    wgpu::TextureDescriptor {
        label: None,
        size: extent(size),
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | TextureUsages::COPY_SRC,
        view_formats: &[],
    }
}

/// Wraps nephroid's image as a texture of wgpu, without a copy. wgpu uses the image until the texture and everything
/// made from it are dropped, and the device is polled after that.
///
/// # Safety
/// The image is in layout GENERAL and outlives wgpu's use of it.
pub unsafe fn wrap(host: &Host, map: MapImage) -> wgpu::Texture {
    let format = TextureFormat::Rgba32Float;
    let descriptor = describe(map.size, format, TextureUsages::TEXTURE_BINDING);
    let hal_descriptor = hal::TextureDescriptor {
        label: descriptor.label,
        size: descriptor.size,
        mip_level_count: descriptor.mip_level_count,
        sample_count: descriptor.sample_count,
        dimension: descriptor.dimension,
        format: descriptor.format,
        usage: TextureUses::RESOURCE | TextureUses::COPY_SRC,
        memory_flags: hal::MemoryFlags::empty(),
        view_formats: Vec::new(),
    };
    // If there is a callback, even an empty one, wgpu does not destroy the image.
    let callback: hal::DropCallback = Box::new(|| ());
    let memory = TextureMemory::External;
    // SAFETY: the image belongs to this device and fits the descriptions. The caller keeps it valid.
    unsafe {
        let device = host.device.as_hal::<Vulkan>().expect("opened on Vulkan");
        let texture = device.texture_from_raw(map.image, &hal_descriptor, Some(callback), memory);
        (host.device).create_texture_from_hal::<Vulkan>(texture, &descriptor, GENERAL)
    }
}

/// Draws the floor. This is plain wgpu: the light map is a texture like any other.
pub struct View {
    pipeline: wgpu::RenderPipeline,
    bindings: wgpu::BindGroup,
    pub picture: wgpu::Texture,
}

impl View {
    pub fn new(host: &Host, light_map: &wgpu::Texture, tile: &ReceiverTile) -> Self {
        let device = &host.device;
        let format = TextureFormat::Rgba8UnormSrgb;
        let descriptor = describe(PICTURE, format, TextureUsages::RENDER_ATTACHMENT);
        let picture = device.create_texture(&descriptor);
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants: &[
                ("left", f64::from(tile.light.origin[0])),
                ("top", f64::from(tile.light.origin[1])),
                ("width", f64::from(tile.light.size[0])),
                ("height", f64::from(tile.light.size[1])),
            ],
            ..Default::default()
        };
        let module = device.create_shader_module(wgpu::include_wgsl!("floor.wgsl"));
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: compilation_options.clone(),
                buffers: &[],
            },
            primitive: Default::default(),
            depth_stencil: None,
            multisample: Default::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options,
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let light_view = light_map.create_view(&Default::default());
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&light_view),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::Sampler(&sampler),
                },
            ],
        });
        Self {
            pipeline,
            bindings,
            picture,
        }
    }

    pub fn draw(&self, encoder: &mut wgpu::CommandEncoder) {
        let view = self.picture.create_view(&Default::default());
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations::default(),
            })],
            ..Default::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bindings, &[]);
        pass.draw(0..3, 0..1);
    }
}

/// Reads a part of a texture row by row, after all submitted work. wgpu requires rows of a multiple of 256 bytes.
pub fn read(
    host: &Host,
    texture: &wgpu::Texture,
    [x, y]: [u32; 2],
    size: [u32; 2],
) -> Result<Vec<u8>> {
    let texel = (texture.format().block_copy_size(None)).expect("a colour format");
    let row = size[0] * texel;
    let buffer = host.device.create_buffer(&wgpu::BufferDescriptor {
        label: None,
        size: u64::from(row * size[1]),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = host.device.create_command_encoder(&Default::default());
    encoder.copy_texture_to_buffer(
        wgpu::TexelCopyTextureInfo {
            origin: wgpu::Origin3d { x, y, z: 0 },
            ..texture.as_image_copy()
        },
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(row),
                rows_per_image: None,
            },
        },
        extent(size),
    );
    host.queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |result| {
        result.expect("a buffer that can be mapped");
    });
    host.device.poll(wgpu::PollType::wait_indefinitely())?;
    Ok(buffer.get_mapped_range(..)?.to_vec())
}
