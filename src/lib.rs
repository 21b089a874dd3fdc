//! nephroid renders caustics: the light that mirrors, glass and water cast onto other surfaces. It computes
//! receiver irradiance in physical units on an explicit Vulkan pipeline, and checks it against an
//! independent reference on the CPU. The method is that of Wand & Straßer (*Real-Time Caustics*,
//! 2003), by default with splats in place of their gather; [`method`] has the equations.
//!
//! # Example
//!
//! The caustic on the ring's floor as a light map, 32-bit float EXR in W/m²:
//!
//! ```no_run
//! use nephroid::gpu::{Context, ContextOptions};
//! use nephroid::image_file::write_exr;
//! use nephroid::render::{Renderer, Settings};
//! use std::path::Path;
//!
//! fn main() -> nephroid::Result<()> {
//!     let scene = nephroid::scene::load(Path::new("assets/scenes/ring.toml"))?.scene;
//!     let floor = scene.object_index("floor").expect("the ring stands on a floor");
//!
//!     let context = Context::new(&ContextOptions::default())?;
//!     let mut renderer = Renderer::new(&context, &scene, &Settings::default())?;
//!     renderer.caustic()?;
//!     let map = renderer.read_caustic(floor)?;
//!     write_exr(Path::new("floor.exr"), &map, &[], "caustic irradiance, W/m^2")
//! }
//! ```
//!
//! # The tour
//!
//! [`scene`] reads a scene file and the meshes and images that it names into plain data: SI units, radians,
//! f64, no Vulkan, at one time; [`scene::Animation`] returns the scene at any time. A scene that it returns can be
//! rendered. A file that cannot be used is an [`Error`] with file, line and remedy; input that is usable but odd
//! is a warning.
//!
//! [`gpu`] is a thin layer over ash: the device, its own or that of a host application, buffers and images that own
//! their memory, pipelines that read their bindings from the SPIR-V, and a recorder with named passes. All
//! shaders are in `glsl/`, in folders of the same names as those of `src/render`, one file per pass.
//!
//! [`render`] is the renderer. `src/render/frame.rs` has every pass and every barrier of a frame, in order:
//!
//! - *upload* copies the changes of the scene to the device. [`render::Renderer::update`] finds them: triangles, a
//!   bounding volume hierarchy, lights and receivers, with positions relative to the centre of the scene. *place triangles* moves
//!   meshes that move as a whole, and *refit hierarchy* fits the boxes to what moved.
//! - *Suns and lamps on planar receivers.* The casters' triangles are facets. *facet flux* computes the light that each facet
//!   sends to each receiver. By this flux, *count patches* divides facets into patches, the paper's sample points, and *trace
//!   facets* and *trace patches* test the visibility of their corners. Each patch acts as a pinhole camera: *project triangles*
//!   computes the image of the light on a receiver, as triangles and, at folds, as kernels.
//! - *Chains*: light that meets several specular surfaces on its way to a receiver. *pilot chains* finds the number of
//!   rays, *trace chains* follows a wave of rays to the next surface, *emit chains* writes the next wave and the footprints,
//!   and *finish chains* follows the remaining rays to their end. On mesh receivers, *count landings* and *project landings*
//!   turn what landed into mesh footprints.
//! - *Mesh receivers and environments.* For suns and lamps on mesh receivers, *sample* divides the casters into patches of even
//!   size; environment cells are projected by patch clusters. *project* computes the splats: footprints, which are kernels with a
//!   centre, a covariance and a flux, and on planar receivers pinhole images of environment cells. *compact* lists the used
//!   slots in a fixed order, so that equal input gives equal bits on the same device and driver.
//! - *splat* adds the splats to the light maps by blending. On planar receivers, wide splats go to coarser levels, which
//!   *resolve* adds to the finer ones.
//! - *Direct light and the view* (`src/render/view/frame.rs`): the direct maps hold light that reaches diffuse surfaces without a
//!   caster. The camera's view shows diffuse surfaces by these maps and the light maps, and traces rays where a pixel
//!   shows a mirror, an interface or several surfaces.
//!
//! [`render::Method`] lists the methods. After *sample*, `pinhole` has one pass, *gather*: the paper's sum over
//! all patches at every texel. `points` has *trace points* and *splat points* only. `beams` draws each patch as one
//! triangle and ignores the width of the light.
//!
//! [`render::Renderer::record`] records a frame into a command buffer of a host application (`docs/embedding.md`). The
//! blocking calls, such as [`render::Renderer::caustic`], record the same passes and submit them.
//!
//! [`flux_balance`] says where the light of chains ends, and how much is cut off: [`render::Renderer::flux_balance`] counts it on
//! request, and [`reference::flux_balance`] estimates it.
//!
//! [`tone_map`] turns linear radiance into sRGB bytes, [`image_file`] reads and writes EXR and PNG files, and
//! [`output`] writes files whole or not at all.
//!
//! [`mod@reference`] computes the same light maps on the CPU in f64, unbiased, with a standard error for
//! every texel, and the camera's view, and keeps them on disk. It imports neither `gpu` nor `render`. It shares the loaded
//! scene with its atlases, the laws of reflection and refraction in [`optics`], and the colours of wavelengths in
//! [`spectrum`] with the renderer.
//!
//! [`measure`] compares images and sequences with a reference, and summarises the times of passes.
//! [`measure::stress`] sweeps through the situations where methods fail.
//! [`measure::sweep`] measures every method over its settings, and [`measure::chart`] reports it:
//! speed against accuracy, as a page, a drawing, a table and JSON.
//!
//! [`error`] is the one public error type. The command line, `src/main.rs` and `src/cli/`, has one
//! file per command.
//!
//! # Features
//!
//! `cli`, on by default, adds the program and the modules that only it and the tests need: [`mod@reference`] and [`measure`]. A
//! host application leaves it out by `default-features = false`, and builds about half as many crates.
//! `viewer` adds the window of the program, `nephroid view`; it is a host of the library (`docs/viewer.md`).
//! `bundled-shaderc` compiles the shaders where no `glslc` is installed.

pub mod error;
pub mod flux_balance;
pub mod gpu;
pub mod image_file;
pub mod input;
mod math;
#[cfg(feature = "cli")]
pub mod measure;
pub mod method {
    #![doc = include_str!("method.md")]
}
pub mod optics;
pub mod output;
#[cfg(feature = "cli")]
pub mod reference;
pub mod render;
pub mod scene;
pub mod spectrum;
pub mod srgb;
pub mod tone_map;

pub use error::{Error, Result};

// Crates whose types appear in the public interface, so that a host can use the same versions.
pub use {ash, glam, gpu_allocator};
