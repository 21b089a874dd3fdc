//! Options of the renderer that `render` and `bake` share.

use super::light_map_size::LightMapSize;
use super::timeline::Timeline;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use nephroid::render::{Area, DEFAULT_ERROR, Method, Settings};
use nephroid::{Error, Result};
use std::time::Duration;

#[derive(Args)]
pub struct GpuOptions {
    #[command(flatten)]
    pub timeline: Timeline,
    /// Method that computes the caustic
    #[arg(long, value_parser = method_parser(), default_value = Settings::default().method.name())]
    pub method: Method,
    /// Number of patches to aim for (at least one for each lit triangle), or of points [default: 16384]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000_000))]
    samples: Option<u32>,
    /// footprint: relative L1 error to aim for on planar receivers under suns and lamps [default: 0.02, without
    /// --samples]
    #[arg(long, conflicts_with = "samples", value_parser = relative_error)]
    error: Option<f32>,
    /// footprint: time that the update and the caustic of a frame may take, in ms. The error to aim for is chosen again for
    /// every frame. The first frame is repeated, at most 20 times, until the budget is met
    #[arg(long, value_name = "MS", conflicts_with_all = ["samples", "error"], value_parser = budget)]
    pub budget_ms: Option<Duration>,
    /// Size of the light maps in texels: the width, with the height in the scene file's proportion, or
    /// WIDTHxHEIGHT
    #[arg(long)]
    pub lightmap: Option<LightMapSize>,
    /// footprint: maximum number of environment cells (at least 8) [default: 4096]
    #[arg(long, value_parser = clap::value_parser!(u32).range(8..=1_000_000))]
    environment_cells: Option<u32>,
    /// footprint: approximate number of images of environment cells for every sample, times the environment's
    /// share of all light [default: 4]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1000))]
    environment_images: Option<u32>,
    /// pinhole: ε of the form factor's d² + ε, in squared patch diameters [default: 1]
    #[arg(long, value_parser = not_negative)]
    epsilon: Option<f32>,
    /// pinhole: do not blur the light by the mirror's curvature
    #[arg(long)]
    no_filter: bool,
    /// beams: formula for the area that a patch lights [default: true]
    #[arg(long, value_parser = area_parser())]
    area: Option<Area>,
    /// Print what the caustic leaves out, why, and how much of the light that is
    #[arg(long)]
    pub explain: bool,
    /// Index or part of the name of the Vulkan device
    #[arg(long)]
    pub device: Option<String>,
    /// Run under the Vulkan validation layers; any message is an error
    #[arg(long)]
    pub validate: bool,
    /// Time every pass over 50 frames after a warm-up (fewer if they take longer than 10 s), or over the frames of a sequence
    #[arg(long)]
    pub profile: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

pub(super) fn method_parser() -> impl TypedValueParser<Value = Method> {
    one_of(Method::ALL, Method::name, |method| match method {
        Method::Footprint => {
            "Every patch projects the lights onto the receivers as splats, which are added up"
        }
        Method::Pinhole => "Every texel gathers over all patches (Wand & Straßer 2003)",
        Method::Points => "Low-discrepancy points are traced to one texel each",
        Method::Beams => "Patches are drawn as triangles between their corners' outgoing rays",
    })
}

fn area_parser() -> impl TypedValueParser<Value = Area> {
    one_of(Area::ALL, Area::name, |area| match area {
        Area::True => "The true area: the length of the sides' cross product",
        Area::Product => {
            "The product of the lengths of the derivatives by texel, `length(dFdx(x)) * length(dFdy(x))`: \
             widespread, but correct only where the derivatives are perpendicular"
        }
    })
}

/// Accepts the names of `values`. The library does not know clap, so its enums do not derive `ValueEnum`.
pub(super) fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    values: [T; N],
    name: fn(T) -> &'static str,
    help: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let possible = values.map(|value| PossibleValue::new(name(value)).help(help(value)));
    PossibleValuesParser::new(possible).map(move |chosen| {
        let value = values.into_iter().find(|&value| name(value) == chosen);
        value.expect("clap accepts these names only")
    })
}

pub(super) fn relative_error(text: &str) -> Result<f32, String> {
    let value = text.parse().ok().filter(|x: &f32| (1e-4..=1.0).contains(x));
    value.ok_or("give a relative error from 0.0001 to 1, such as 0.02 for 2 %".into())
}

pub(super) fn budget(text: &str) -> Result<Duration, String> {
    let milliseconds = text.parse().ok().filter(|x: &f64| (0.1..=1e5).contains(x));
    let seconds = milliseconds.map(|milliseconds| Duration::from_secs_f64(1e-3 * milliseconds));
    seconds.ok_or("give milliseconds from 0.1 to 100000, such as 16".into())
}

fn not_negative(text: &str) -> Result<f32, String> {
    let value = text
        .parse()
        .ok()
        .filter(|x: &f32| x.is_finite() && *x >= 0.0);
    value.ok_or("give a number that is not negative".into())
}

impl GpuOptions {
    /// The error to aim for, if there is one.
    pub fn error_target(&self) -> Option<f32> {
        match self.samples {
            None if self.method == Method::Footprint && self.budget_ms.is_none() => {
                Some(self.error.unwrap_or(DEFAULT_ERROR))
            }
            _ => None,
        }
    }

    /// The renderer's settings.
    ///
    /// # Errors
    /// [`Error::Usage`] where an option is given that the method does not have.
    pub fn settings(&self) -> Result<Settings> {
        let options = [
            ("--error", self.error.is_some(), Method::Footprint),
            ("--budget-ms", self.budget_ms.is_some(), Method::Footprint),
            (
                "--environment-cells",
                self.environment_cells.is_some(),
                Method::Footprint,
            ),
            (
                "--environment-images",
                self.environment_images.is_some(),
                Method::Footprint,
            ),
            ("--epsilon", self.epsilon.is_some(), Method::Pinhole),
            ("--no-filter", self.no_filter, Method::Pinhole),
            ("--area", self.area.is_some(), Method::Beams),
        ];
        for (option, is_given, method) in options {
            if is_given && method != self.method {
                let (its, this) = (method.name(), self.method.name());
                return Err(Error::Usage {
                    reason: format!("{option} is an option of the method {its}, not of {this}"),
                    remedy: format!("leave it out, or give --method {its}"),
                });
            }
        }
        let default = Settings::default();
        Ok(Settings {
            method: self.method,
            samples: self.samples.unwrap_or(default.samples),
            error: self.error_target(),
            budget: self.budget_ms,
            environment_cells: self.environment_cells.unwrap_or(default.environment_cells),
            environment_images: self
                .environment_images
                .unwrap_or(default.environment_images),
            epsilon: self.epsilon.unwrap_or(default.epsilon),
            filter: !self.no_filter,
            area: self.area.unwrap_or(default.area),
            ..default
        })
    }
}
