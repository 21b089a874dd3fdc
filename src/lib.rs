//! nephroid renders caustics: the light that mirrors and water throw onto other surfaces. It computes
//! receiver irradiance in physical units on an explicit Vulkan pipeline, and checks it against an
//! independent reference on the CPU. The method is that of Wand & Straßer (*Real-Time Caustics*,
//! 2003), with footprints in place of their gather as the default; [`method`] has the equations.
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
//! f64, no Vulkan, at one time; [`scene::Animation`] has it at every time. What it returns is fit to be
//! rendered; what is wrong with a file is an [`Error`] with file, line and remedy, and what is merely odd
//! is a warning.
//!
//! [`gpu`] is a thin layer over ash: the device, of our own or of a host application, buffers and images that own
//! their memory, pipelines that read their bindings from the SPIR-V, and a recorder with named passes. All
//! shaders are in `glsl/`, in folders of the same names as those of `src/render`, one file a pass.
//!
//! [`render`] is the renderer. `src/render/frame.rs` has every pass and every barrier of a frame, in order:
//!
//! - *upload*: what changed in the scene is copied to the device. [`render::Renderer::update`] finds it: triangles, a
//!   bounding volume hierarchy, lights and receivers, around an origin in the middle of the scene.
//! - *sample*: the casters' triangles are divided into patches, the paper's sample points: small triangles with a normal
//!   and its derivatives along the edges.
//! - *project*: each patch images each light onto each receiver. A narrow light gives a triangle; a wide one a
//!   footprint, that is a kernel with a centre, a covariance and a flux. Cells of an environment are imaged by patch
//!   clusters: as pinhole images, with their edges, where a cluster is far enough from the receiver to be a point, and as
//!   footprints where it is not. One ray finds whether the light is visible, another whether the receiver is.
//! - *compact*: the splats that exist are listed in a fixed order, so that equal input gives equal
//!   bits on the same device and driver.
//! - *splat*: each splat becomes a quad and is added to the light maps by blending, wide ones at a coarser level.
//! - *resolve*: the coarser levels are interpolated and added to the light maps.
//! - *direct*: light that reaches the receivers without a caster.
//! - *shade*: the camera's view. Diffuse surfaces show direct light and the light maps, mirrors show
//!   what they reflect.
//!
//! Mesh receivers have footprints of their own, which find the texels that they reach in space and not on a plane. The
//! method `pinhole` replaces project to resolve by *gather*, the sum over all patches at every texel.
//! The method `beams` has triangles only, without the light's width. The method `points` replaces project to resolve by
//! *trace points* and *splat points*. [`render::Method`] lists them.
//!
//! [`render::Renderer::record`] records a frame into a command buffer of a host application (`docs/embedding.md`). The
//! blocking calls, such as [`render::Renderer::caustic`], record the same and submit it.
//!
//! [`tone_map`] turns linear radiance into sRGB bytes, [`image_file`] reads and writes EXR and PNG files, and
//! [`output`] writes files whole or not at all.
//!
//! [`mod@reference`] computes the same light maps on the CPU in f64, unbiased, with a standard error for
//! every texel, and the camera's view, and keeps them on disk. It imports neither `gpu` nor `render`; its law of reflection is in
//! [`optics`].
//!
//! [`measure`] compares images and sequences with a reference, and sums up the times of passes.
//! [`measure::stress`] sweeps through the places where methods fail.
//! [`measure::sweep`] measures every method over its settings, and [`measure::chart`] reports it:
//! speed against accuracy, as a page, a drawing, a table and JSON.
//!
//! [`error`] is the one public error type. The command line, `src/main.rs` and `src/cli/`, has one
//! file a command.
//!
//! # Features
//!
//! `cli`, on by default, has the program and what only it and the tests need: [`mod@reference`] and [`measure`]. A
//! host application does without, by `default-features = false`, and builds less than half as many crates.
//! `viewer` adds the window of the program, `nephroid view`; it is a host of the library (`docs/viewer.md`).
//! `bundled-shaderc` compiles the shaders where no `glslc` is installed.

pub mod error;
pub mod gpu;
pub mod image_file;
mod input;
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
