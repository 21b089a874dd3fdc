//! `nephroid bake`: a receiver's light map.

use super::gpu_options::GpuOptions;
use super::{find_receiver, has_extension};
use clap::{Args, ValueEnum};
use nephroid::image_file::{RgbImage, check_writable, write_exr};
use nephroid::{Error, Result};
use std::path::PathBuf;

/// Render a receiver's light map on the device
///
/// Writes irradiance in W/m² as 32-bit float EXR; last row at v = 0, column 0 at u = 0.
#[derive(Args)]
pub struct Arguments {
    /// Scene file (.toml)
    scene: PathBuf,
    /// Receiver; may be left out if the scene has only one
    #[arg(long)]
    receiver: Option<String>,
    /// EXR file to write
    #[arg(short, long)]
    output: PathBuf,
    /// Which light to write
    #[arg(long, value_enum, default_value_t = Component::Caustic)]
    component: Component,
    #[command(flatten)]
    gpu: GpuOptions,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Component {
    /// Light that met exactly one mirror
    Caustic,
    /// Light straight from suns and environment
    Direct,
    /// Both
    Total,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let output = arguments.output.as_path();
    if !has_extension(output, "exr") {
        return Err(Error::Usage {
            reason: format!("{} is not an .exr file", output.display()),
            remedy: "end the output's name with .exr".into(),
        });
    }
    check_writable(output)?;
    let mut session = arguments.gpu.open(&arguments.scene)?;
    let (receiver, _) = find_receiver(&session.scene, arguments.receiver.as_deref())?;
    let component = arguments.component;
    let has_caustic = component != Component::Direct;
    let gpu = &arguments.gpu;
    let report = gpu.run(
        &mut session,
        output,
        has_caustic,
        |renderer, _| match component {
            Component::Caustic => renderer.caustic(),
            Component::Direct => renderer.direct(),
            Component::Total => renderer.caustic().and_then(|()| renderer.direct()),
        },
    )?;
    let renderer = &session.renderer;
    let image = match component {
        Component::Caustic => renderer.read_caustic(receiver)?,
        Component::Direct => renderer.read_direct(receiver)?,
        Component::Total => sum(
            renderer.read_caustic(receiver)?,
            &renderer.read_direct(receiver)?,
        ),
    };
    session.finish()?;
    let comment = format!("{component:?} irradiance, W/m^2").to_lowercase();
    write_exr(output, &image, &[], &comment)?;
    report.print(gpu.json);
    Ok(())
}

fn sum(mut a: RgbImage, b: &RgbImage) -> RgbImage {
    for (a, b) in a.pixels.iter_mut().flatten().zip(b.pixels.iter().flatten()) {
        *a += b;
    }
    a
}
