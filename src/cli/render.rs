//! `nephroid render`: the camera's view.

use super::files::{Files, has_extension};
use super::gpu_options::GpuOptions;
use clap::Args;
use nephroid::image_file::{write_exr, write_png};
use nephroid::{Result, tone_map};

/// Render the camera's view with its caustics
///
/// Writes a tone-mapped .png (Khronos PBR Neutral, sRGB) or linear radiance, W/m²/sr, as .exr.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    files: Files,
    /// Pixels, WIDTHxHEIGHT
    #[arg(long, default_value = "1280x720", value_parser = picture_size)]
    size: [u32; 2],
    /// Each pixel is the mean of this number squared of samples
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=16))]
    antialias: u32,
    #[command(flatten)]
    gpu: GpuOptions,
}

fn picture_size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|n| (1..=16384).contains(n));
    let size = text
        .split_once('x')
        .and_then(|(w, h)| Some([side(w)?, side(h)?]));
    size.ok_or("give WIDTHxHEIGHT in 1 to 16384 pixels".into())
}

pub fn run(arguments: &Arguments) -> Result<()> {
    arguments.files.check_output(&["png", "exr"])?;
    let output = arguments.files.output.as_path();
    let mut session = arguments.gpu.open(&arguments.files.scene)?;
    let gpu = &arguments.gpu;
    let report = gpu.run(&mut session, output, true, |renderer, scene| {
        renderer.view(&scene.camera, arguments.size, arguments.antialias)
    })?;
    let view = session.renderer.read_view()?;
    let exposure_ev = session.scene.camera.exposure_ev;
    session.finish()?;
    if has_extension(output, "png") {
        let rgb = tone_map::to_srgb(&view, exposure_ev);
        write_png(output, view.width, view.height, &rgb)?;
    } else {
        write_exr(output, &view, &[], "radiance, W/m^2/sr")?;
    }
    report.print(gpu.json);
    Ok(())
}
