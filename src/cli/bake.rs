//! `nephroid bake`: a receiver's light map.

use super::files::MapFiles;
use super::gpu_options::GpuOptions;
use super::job::Job;
use super::session::Session;
use clap::{Args, ValueEnum};
use nephroid::Result;
use nephroid::image_file::{RgbImage, write_exr};
use nephroid::render::Renderer;
use nephroid::scene::Scene;
use std::path::Path;

/// Render a receiver's light map on the device
///
/// Writes irradiance in W/m² as 32-bit float EXR. The last row is at v = 0, column 0 at u = 0.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    map: MapFiles,
    /// Light to write
    #[arg(long, value_enum, default_value_t = Component::Caustic)]
    component: Component,
    #[command(flatten)]
    gpu: GpuOptions,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Component {
    /// Light that met specular surfaces
    Caustic,
    /// Light that comes directly from suns, lamps and the environment
    Direct,
    /// Sum of caustic and direct
    Total,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (files, gpu) = (&arguments.map.files, &arguments.gpu);
    let shots = files.shots(&gpu.timeline, &["exr"])?;
    let session = Session::open(gpu, files, &shots)?;
    let (receiver, _) = arguments.map.find_receiver(&session.scene)?;
    let component = arguments.component;
    let job = Bake {
        receiver,
        component,
    };
    gpu.execute(session, files, &shots, &job)
}

struct Bake {
    receiver: usize,
    component: Component,
}

impl Job for Bake {
    fn has_caustic(&self) -> bool {
        self.component != Component::Direct
    }

    fn reports_flux(&self) -> bool {
        self.has_caustic()
    }

    fn render(&self, renderer: &mut Renderer, _: &Scene) -> Result<()> {
        match self.component {
            Component::Caustic => renderer.caustic(),
            Component::Direct => renderer.direct(),
            Component::Total => renderer.caustic().and_then(|()| renderer.direct()),
        }
    }

    fn read(&self, renderer: &Renderer) -> Result<RgbImage> {
        let receiver = self.receiver;
        match self.component {
            Component::Caustic => renderer.read_caustic(receiver),
            Component::Direct => renderer.read_direct(receiver),
            Component::Total => Ok(sum(
                renderer.read_caustic(receiver)?,
                &renderer.read_direct(receiver)?,
            )),
        }
    }

    fn write(&self, file: &Path, _: &Scene, image: &RgbImage) -> Result<()> {
        let comment = format!("{:?} irradiance, W/m^2", self.component).to_lowercase();
        write_exr(file, image, &[], &comment)
    }
}

fn sum(mut a: RgbImage, b: &RgbImage) -> RgbImage {
    for (a, b) in a.pixels.iter_mut().flatten().zip(b.pixels.iter().flatten()) {
        *a += b;
    }
    a
}
