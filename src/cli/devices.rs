//! `nephroid devices`: what Vulkan offers.

use super::terminal::{print, print_json};
use clap::Args;
use nephroid::Result;
use nephroid::gpu::list_devices;

/// List the Vulkan devices, best first, with the indices that --device takes
#[derive(Args)]
pub struct Arguments {
    /// Print as JSON
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let devices = list_devices()?;
    if arguments.json {
        return print_json(&devices);
    }
    for (index, device) in devices.iter().enumerate() {
        let unsuitable = device.unsuitable.as_ref();
        let remark = unsuitable.map_or(String::new(), |reason| format!(", unsuitable: {reason}"));
        print(&format!(
            "{index}  {} ({}, Vulkan {}, {}){remark}",
            device.name, device.kind, device.api_version, device.driver
        ))?;
    }
    Ok(())
}
