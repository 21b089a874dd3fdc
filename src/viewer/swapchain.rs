//! The surface of the window and the images that it shows.

use super::host::{Host, failed, no_window};
use ash::{khr, vk};
use nephroid::{Error, Result};
use winit::window::Window;

/// Wait for an image of the window, at most, ns. A hidden window may have none.
const ACQUIRE_TIMEOUT: u64 = 1_000_000_000;

/// Outcome of a request for an image, or of presenting one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presented<T> {
    Done(T),
    /// The images no longer fit the window.
    OutOfDate,
    /// The surface is gone.
    SurfaceLost,
    /// The window shows nothing at present.
    NotReady,
}

/// Images of a surface. The host destroys it with [`Swapchain::destroy`].
pub struct Swapchain {
    functions: khr::swapchain::Device,
    surface: vk::SurfaceKHR,
    handle: vk::SwapchainKHR,
    pub format: vk::SurfaceFormatKHR,
    pub size: [u32; 2],
    pub images: Vec<(vk::Image, vk::ImageView)>,
    /// Signalled when an image may be shown, one for each.
    finished: Vec<vk::Semaphore>,
}

impl Swapchain {
    /// Without images: [`Swapchain::resize`] makes them.
    ///
    /// # Errors
    /// [`Error::Window`] where the surface has no format that can be drawn to.
    pub fn new(host: &Host, surface: vk::SurfaceKHR) -> Result<Self> {
        // SAFETY: device and surface are of the host.
        let formats = unsafe {
            host.surfaces
                .get_physical_device_surface_formats(host.physical, surface)
        }
        .map_err(failed("asking for the formats of the window"))?;
        let format = choose_format(&formats).ok_or_else(|| {
            no_window(
                "the window has no format of 8 bits per channel",
                "choose another device",
            )
        })?;
        Ok(Self {
            functions: host.swapchains(),
            surface,
            handle: vk::SwapchainKHR::null(),
            format,
            size: [0; 2],
            images: Vec::new(),
            finished: Vec::new(),
        })
    }

    /// Whether the format encodes sRGB by itself.
    pub fn encodes_srgb(&self) -> bool {
        matches!(
            self.format.format,
            vk::Format::B8G8R8A8_SRGB | vk::Format::R8G8B8A8_SRGB
        )
    }

    /// Makes the images again for a window of `size` pixels; none if it is not visible. The device must be idle.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn resize(&mut self, host: &Host, size: [u32; 2]) -> Result<Presented<()>> {
        // SAFETY: device and surface are of the host, and the device is idle.
        unsafe {
            let asked = host
                .surfaces
                .get_physical_device_surface_capabilities(host.physical, self.surface);
            let capabilities = match asked {
                Err(vk::Result::ERROR_SURFACE_LOST_KHR) => return Ok(Presented::SurfaceLost),
                other => other.map_err(failed("asking for the size of the window"))?,
            };
            let extent = extent(&capabilities, size);
            if extent.width == 0 || extent.height == 0 {
                return Ok(Presented::NotReady);
            }
            let most = match capabilities.max_image_count {
                0 => u32::MAX,
                most => most,
            };
            let alpha = [
                vk::CompositeAlphaFlagsKHR::OPAQUE,
                vk::CompositeAlphaFlagsKHR::INHERIT,
            ]
            .into_iter()
            .find(|alpha| capabilities.supported_composite_alpha.contains(*alpha))
            .unwrap_or(vk::CompositeAlphaFlagsKHR::OPAQUE);
            let info = vk::SwapchainCreateInfoKHR::default()
                .surface(self.surface)
                .min_image_count((capabilities.min_image_count + 1).min(most))
                .image_format(self.format.format)
                .image_color_space(self.format.color_space)
                .image_extent(extent)
                .image_array_layers(1)
                .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT)
                .image_sharing_mode(vk::SharingMode::EXCLUSIVE)
                .pre_transform(capabilities.current_transform)
                .composite_alpha(alpha)
                .present_mode(vk::PresentModeKHR::FIFO)
                .clipped(true)
                .old_swapchain(self.handle);
            let made = self.functions.create_swapchain(&info, None);
            // The old one is retired, whether or not there is a new one.
            self.destroy_images(host);
            self.handle = match made {
                Err(vk::Result::ERROR_SURFACE_LOST_KHR) => return Ok(Presented::SurfaceLost),
                // The window changed again in the meantime.
                Err(
                    vk::Result::ERROR_OUT_OF_DATE_KHR | vk::Result::ERROR_NATIVE_WINDOW_IN_USE_KHR,
                ) => {
                    return Ok(Presented::OutOfDate);
                }
                other => other.map_err(failed("making the images of the window"))?,
            };
            self.size = [extent.width, extent.height];
            let images = (self.functions.get_swapchain_images(self.handle))
                .map_err(failed("asking for the images of the window"))?;
            for image in images {
                let info = vk::ImageViewCreateInfo::default()
                    .image(image)
                    .view_type(vk::ImageViewType::TYPE_2D)
                    .format(self.format.format)
                    .subresource_range(color_range());
                let view = (host.device.create_image_view(&info, None))
                    .map_err(failed("making a view of the window"))?;
                self.images.push((image, view));
                let info = vk::SemaphoreCreateInfo::default();
                let semaphore = (host.device.create_semaphore(&info, None))
                    .map_err(failed("making a semaphore"))?;
                self.finished.push(semaphore);
            }
        }
        Ok(Presented::Done(()))
    }

    /// Index of the next image; `acquired` is signalled when it can be drawn to.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn acquire(&self, acquired: vk::Semaphore) -> Result<Presented<u32>> {
        if self.images.is_empty() {
            return Ok(Presented::OutOfDate);
        }
        // SAFETY: the semaphore is unsignalled and nothing waits for it.
        let result = unsafe {
            self.functions.acquire_next_image(
                self.handle,
                ACQUIRE_TIMEOUT,
                acquired,
                vk::Fence::null(),
            )
        };
        match result {
            // A suboptimal image is drawn to, and the images are made again afterwards.
            Ok((index, _)) => Ok(Presented::Done(index)),
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => Ok(Presented::NotReady),
            Err(error) => lost(error, "asking for an image of the window"),
        }
    }

    /// Signalled by the submission that draws this image.
    pub fn finished(&self, image: u32) -> vk::Semaphore {
        self.finished[image as usize]
    }

    /// Shows an image when its semaphore is signalled.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn present(&self, host: &Host, image: u32) -> Result<Presented<()>> {
        let (swapchains, indices, semaphores) = ([self.handle], [image], [self.finished(image)]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&semaphores)
            .swapchains(&swapchains)
            .image_indices(&indices);
        // SAFETY: the image was acquired, and the semaphore is signalled by a submission.
        match unsafe { self.functions.queue_present(host.queue, &info) } {
            Ok(false) => Ok(Presented::Done(())),
            Ok(true) => Ok(Presented::OutOfDate),
            Err(error) => lost(error, "showing a picture"),
        }
    }

    /// Replaces a surface that was lost. The device must be idle.
    ///
    /// # Errors
    /// [`Error::Window`] where the window has no other.
    pub fn replace_surface(&mut self, host: &Host, window: &Window) -> Result<()> {
        self.destroy(host);
        self.surface = host.surface(window)?;
        Ok(())
    }

    /// The device must be idle.
    fn destroy_images(&mut self, host: &Host) {
        // SAFETY: the device is idle.
        unsafe {
            for (_, view) in self.images.drain(..) {
                host.device.destroy_image_view(view, None);
            }
            for semaphore in self.finished.drain(..) {
                host.device.destroy_semaphore(semaphore, None);
            }
            self.functions.destroy_swapchain(self.handle, None);
        }
        self.handle = vk::SwapchainKHR::null();
    }

    /// The device must be idle.
    pub fn destroy(&mut self, host: &Host) {
        self.destroy_images(host);
        // SAFETY: nothing is made from the surface any more.
        unsafe { host.surfaces.destroy_surface(self.surface, None) };
        self.surface = vk::SurfaceKHR::null();
    }
}

fn lost<T>(error: vk::Result, action: &str) -> Result<Presented<T>> {
    match error {
        vk::Result::ERROR_OUT_OF_DATE_KHR => Ok(Presented::OutOfDate),
        vk::Result::ERROR_SURFACE_LOST_KHR => Ok(Presented::SurfaceLost),
        error => Err::<_, Error>(failed(action)(error)),
    }
}

/// One of 8 bits that leaves the encoding to the shader, or else one that encodes itself.
fn choose_format(formats: &[vk::SurfaceFormatKHR]) -> Option<vk::SurfaceFormatKHR> {
    [
        vk::Format::B8G8R8A8_UNORM,
        vk::Format::R8G8B8A8_UNORM,
        vk::Format::B8G8R8A8_SRGB,
        vk::Format::R8G8B8A8_SRGB,
    ]
    .into_iter()
    .find_map(|wanted| {
        let is_srgb = |f: &&vk::SurfaceFormatKHR| {
            f.format == wanted && f.color_space == vk::ColorSpaceKHR::SRGB_NONLINEAR
        };
        formats.iter().find(is_srgb).copied()
    })
}

/// The surface's size, or else the window's within what the surface can have.
fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, [width, height]: [u32; 2]) -> vk::Extent2D {
    if capabilities.current_extent.width != u32::MAX {
        return capabilities.current_extent;
    }
    let (least, most) = (capabilities.min_image_extent, capabilities.max_image_extent);
    vk::Extent2D {
        width: width.clamp(least.width, most.width.max(least.width)),
        height: height.clamp(least.height, most.height.max(least.height)),
    }
}

pub fn color_range() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .level_count(1)
        .layer_count(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_formats_come_first() {
        let format = |format| vk::SurfaceFormatKHR {
            format,
            color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR,
        };
        let [srgb, unorm] = [vk::Format::B8G8R8A8_SRGB, vk::Format::B8G8R8A8_UNORM].map(format);
        assert_eq!(choose_format(&[srgb, unorm]).unwrap().format, unorm.format);
        assert_eq!(choose_format(&[srgb]).unwrap().format, srgb.format);
        assert!(choose_format(&[format(vk::Format::R5G6B5_UNORM_PACK16)]).is_none());
    }
}
