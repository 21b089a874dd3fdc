//! `nephroid render`: the camera's view.

use super::files::{Files, has_extension, radiance_comment};
use super::gpu_options::{GpuOptions, one_of};
use super::job::Job;
use super::session::Session;
use clap::Args;
use clap::builder::TypedValueParser;
use nephroid::image_file::{RgbImage, write_exr, write_png};
use nephroid::render::{Overlay, Renderer, ViewMemory};
use nephroid::scene::Scene;
use nephroid::{Result, tone_map};
use std::path::Path;

/// Render the camera's view with its caustics
///
/// Writes a tone-mapped .png (Khronos PBR Neutral, sRGB), or linear radiance in W/m²/sr as .exr.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    files: Files,
    /// Size of the picture in pixels, WIDTHxHEIGHT
    #[arg(long, default_value = "1280x720", value_parser = picture_size)]
    size: [u32; 2],
    /// Square root of the number of samples per pixel; each pixel is the mean of its samples
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..=16))]
    antialias: u32,
    /// Draw over the picture what the frame computed with; may be repeated
    #[arg(long, value_name = "NAME", value_parser = overlay_parser())]
    overlay: Vec<Overlay>,
    #[command(flatten)]
    gpu: GpuOptions,
}

fn overlay_parser() -> impl TypedValueParser<Value = Overlay> {
    one_of(Overlay::ALL, Overlay::name, Overlay::about)
}

/// Width and height of a picture, in pixels.
pub fn picture_size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|n| (1..=16384).contains(n));
    let size = text
        .split_once('x')
        .and_then(|(w, h)| Some([side(w)?, side(h)?]));
    size.ok_or("give WIDTHxHEIGHT in 1 to 16384 pixels".into())
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (files, gpu) = (&arguments.files, &arguments.gpu);
    let shots = files.shots(&gpu.timeline, &["png", "exr"])?;
    let mut session = Session::open(gpu, files, &shots)?;
    session.renderer.set_overlays(&arguments.overlay); // its notes tell which are empty
    gpu.execute(session, files, &shots, arguments)
}

impl Job for Arguments {
    fn has_caustic(&self) -> bool {
        true
    }

    fn view_memory(&self, renderer: &Renderer) -> Option<ViewMemory> {
        Some(renderer.view_memory())
    }

    fn render(&self, renderer: &mut Renderer, scene: &Scene) -> Result<()> {
        renderer.set_overlays(&self.overlay); // a new renderer has none
        renderer.view(&scene.camera, self.size, self.antialias)
    }

    fn read(&self, renderer: &Renderer) -> Result<RgbImage> {
        renderer.read_view()
    }

    fn write(&self, file: &Path, scene: &Scene, image: &RgbImage) -> Result<()> {
        if has_extension(file, "png") {
            let rgb = tone_map::to_srgb(image, scene.camera.exposure_ev);
            write_png(file, image.width, image.height, &rgb)
        } else {
            let comment = radiance_comment(scene.camera.exposure_ev);
            write_exr(file, image, &[], &comment)
        }
    }
}
