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
//! [`gpu`] is a thin layer over ash: the device, buffers and images that own their memory,
//! pipelines that read their bindings from the SPIR-V, and a recorder with named passes. All
//! shaders are in `glsl/`, one file a stage.
//!
//! [`render`] is the renderer. Its module is the list of passes with every barrier. A frame of the
//! default method runs through these stages:
//!
//! - *upload*: triangles, a bounding volume hierarchy, lights and receivers go to the device,
//!   around an origin in the middle of the scene. For another frame, [`render::Renderer::update`]
//!   uploads what has moved.
//! - *sample*: the mirrors' triangles are cut into patches, small triangles with a normal and its
//!   change along the edges.
//! - *project*: each patch images each sun and lamp onto each receiver, as a footprint: a centre, a
//!   covariance and a flux, or under lights much narrower than texels, a triangle. Parts of the sky are
//!   imaged by larger patches: with their edges, where the patch is far enough from the receiver to be a point,
//!   as footprints where it is not. One ray finds whether the light is visible, one whether the receiver is.
//! - *compact*: footprints that exist are listed in a fixed order, so that equal input gives equal
//!   bits on the same device and driver.
//! - *splat*: each footprint becomes a quad, and its kernel, triangle or image is added to the light maps by
//!   blending, wide ones at a coarser level.
//! - *resolve*: the coarser levels are interpolated and added to the light maps.
//! - *direct*: light that reaches the receivers without a mirror.
//! - *shade*: the camera's view. Diffuse surfaces show direct light and the light maps, mirrors show
//!   what they reflect.
//!
//! Receivers that are meshes have a project and splat of their own, which find the texels that a
//! footprint reaches in space and not on a plane.
//!
//! The method `pinhole` replaces project to resolve by *gather*, the sum over all patches at every texel.
//! The method `beams` throws triangles only, without the light's width. The method `points` replaces them
//! and sample by *trace points* and *splat points*. [`render::Method`] lists them.
//!
//! [`tone_map`] turns linear radiance into sRGB bytes, [`image_file`] reads and writes EXR and PNG files, and
//! [`output`] writes files whole or not at all.
//!
//! [`mod@reference`] computes the same light maps on the CPU in f64, unbiased, with a standard error for
//! every texel, and keeps them on disk. It imports neither `gpu` nor `render`; its law of reflection is in
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
pub mod tone_map;

pub use error::{Error, Result};
