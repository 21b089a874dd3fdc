//! `nephroid bake`: a receiver's light map.

use super::files::MapFiles;
use super::gpu_options::GpuOptions;
use clap::{Args, ValueEnum};
use nephroid::Result;
use nephroid::image_file::{RgbImage, write_exr};

/// Render a receiver's light map on the device
///
/// Writes irradiance in W/m² as 32-bit float EXR; last row at v = 0, column 0 at u = 0.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    map: MapFiles,
    /// Which light to write
    #[arg(long, value_enum, default_value_t = Component::Caustic)]
    component: Component,
    #[command(flatten)]
    gpu: GpuOptions,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Component {
    /// Light that met exactly one specular surface
    Caustic,
    /// Light straight from suns and environment
    Direct,
    /// Both
    Total,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let files = &arguments.map.files;
    files.check_output(&["exr"])?;
    let output = files.output.as_path();
    let mut session = arguments.gpu.open(&files.scene)?;
    let (receiver, _) = arguments.map.find_receiver(&session.scene)?;
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
