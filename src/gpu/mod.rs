//! A thin layer over ash: what every pass needs and nothing that one pass alone needs.
//!
//! [`Context`] is the device, ours or a host's, [`Buffer`] and [`Image`] own their memory, [`BoundPipeline`] knows
//! its bindings from the SPIR-V, [`Recorder`] fills a command buffer in named passes and submits ours.

mod access;
mod command;
mod commands;
mod compile;
mod context;
mod device;
mod host;
mod host_memory;
mod image;
mod instance;
mod memory;
mod modules;
mod pace;
mod pipeline;
mod pipeline_cache;
mod pipelines;
mod readback;
mod recorder;
#[cfg(feature = "dev")]
mod reload;
mod requirements;
mod retired;
mod reuse;
mod shader;
mod staging;
mod texel;
mod timestamps;
mod transfer;
mod validation;

pub use access::Access;
pub use commands::Vertices;
pub use context::Context;
pub use device::{ContextOptions, DeviceInfo, SuitableDevice, list_devices};
pub use host::{External, suitable_devices};
pub use host_memory::{DRIVER_STACK, keep_freed_memory, set_stack_of_threads};
pub use image::{Image, Sampling};
pub use memory::Buffer;
pub use pipeline::{BoundPipeline, Resource};
pub use pipelines::{Constants, Topology};
pub use readback::Readback;
pub use recorder::{PassTime, Progress, Recorder, Submissions, Watcher};
#[cfg(feature = "dev")]
pub use reload::NewShaders;
pub use requirements::Requirements;
pub use retired::Retired;
pub use shader::{Shader, StructLayout, shaders};
pub use staging::Staging;
pub use texel::{Colour, Texel};
pub use validation::Messages;

use crate::error::Error;
use ash::vk;

/// Why a Vulkan call failed, in words.
pub fn reason_of(result: vk::Result) -> String {
    match result {
        vk::Result::ERROR_DEVICE_LOST => "the device was lost".into(),
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY => "out of device memory".into(),
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => "out of host memory".into(),
        other => format!("{other} ({other:?})"),
    }
}

/// Turns a failed Vulkan call into an [`Error::Device`] that names what was being done.
fn device_error(action: &str) -> impl FnOnce(vk::Result) -> Error + '_ {
    move |result| {
        Error::Device {
        action: action.to_owned(),
        reason: reason_of(result),
        remedy: match result {
            vk::Result::ERROR_DEVICE_LOST => {
                "ask for fewer samples or smaller light maps, update the driver, or choose another device"
            }
            vk::Result::ERROR_OUT_OF_DEVICE_MEMORY | vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
                "ask for fewer samples or smaller light maps"
            }
            _ => "run again under the validation layers, which say more, or choose another device",
        }
        .into(),
    }
    }
}
