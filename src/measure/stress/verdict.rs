//! Where methods break down, from the figures, and why, from those who looked at them.

use super::super::chart::figure::{figure, rounded};
use super::{Point, Report, SweepReport};

/// What a measure may be before a method has failed.
pub struct Limit {
    /// As in a sentence.
    pub name: &'static str,
    pub bound: f64,
    /// Relative, ≥ 0.
    pub of: fn(&Point) -> Option<f64>,
}

/// The limits, in the order in which they are told.
pub const LIMITS: [Limit; 6] = [
    Limit {
        name: "bad texels",
        bound: 0.0,
        of: |point| Some(point.bad_texels as f64 / f64::from(point.light_map).powi(2)),
    },
    Limit {
        name: "energy error",
        bound: 0.01,
        of: |point| Some((point.energy_ratio? - 1.0).abs()),
    },
    Limit {
        name: "drift",
        bound: 0.002,
        of: |point| point.drift,
    },
    Limit {
        name: "L1",
        bound: 0.05,
        of: |point| point.l1,
    },
    Limit {
        name: "overshoot",
        bound: 0.25,
        of: |point| point.overshoot,
    },
    Limit {
        name: "flicker",
        bound: 0.01,
        of: |point| point.flicker,
    },
];

/// One method in one sweep.
pub struct Verdict<'a> {
    pub sweep: &'a SweepReport,
    pub method: &'a str,
    /// How L1 and energy go from end to end.
    pub course: String,
    /// What goes beyond its limit, and where.
    pub breaks: Vec<Break>,
}

/// A measure beyond its limit.
pub struct Break {
    pub limit: &'static Limit,
    /// First and last value of every run of neighbours that are beyond.
    pub runs: Vec<[f64; 2]>,
    pub worst: f64,
    pub worst_at: f64,
}

impl Verdict<'_> {
    /// Why the method breaks down, where somebody has found out.
    pub fn reason(&self) -> Option<&'static str> {
        (!self.breaks.is_empty())
            .then(|| reason(&self.sweep.name, self.method))
            .flatten()
    }
}

impl Break {
    /// As `L1 above 5 % at 0.03–0.001, worst 34 % at 0.001`.
    pub fn sentence(&self) -> String {
        let runs: Vec<String> = (self.runs.iter())
            .map(|[first, last]| match first == last {
                true => first.to_string(),
                false => format!("{first} to {last}"),
            })
            .collect();
        let Limit { name, bound, .. } = self.limit;
        let beyond = match *bound {
            0.0 => String::new(),
            bound => format!(" above {} %", rounded(100.0 * bound)),
        };
        format!(
            "{name}{beyond} at {} (worst {} % at {})",
            runs.join(", "),
            figure(100.0 * self.worst),
            self.worst_at
        )
    }
}

/// For every method that was measured, methods first, then sweeps in their order.
pub fn verdicts(report: &Report) -> Vec<Verdict<'_>> {
    let mut methods: Vec<&str> = Vec::new();
    for series in report.sweeps.iter().flat_map(|sweep| &sweep.series) {
        if !methods.contains(&series.method.as_str()) {
            methods.push(&series.method);
        }
    }
    (methods.into_iter())
        .flat_map(|method| (report.sweeps.iter()).filter_map(move |sweep| verdict(sweep, method)))
        .collect()
}

fn verdict<'a>(sweep: &'a SweepReport, method: &'a str) -> Option<Verdict<'a>> {
    let series = sweep.series.iter().find(|series| series.method == method)?;
    let points = &series.points;
    let (first, last) = (points.first()?, points.last()?);
    let breaks = (LIMITS.iter())
        .filter_map(|limit| broken(limit, &sweep.values, points))
        .collect();
    let state = |point: &Point| {
        let percent = |value: Option<f64>| {
            value.map_or("–".into(), |value| format!("{} %", figure(100.0 * value)))
        };
        format!(
            "L1 {}, energy {} at {}",
            percent(point.l1),
            (point.energy_ratio).map_or("–".into(), |ratio| format!("{ratio:.4}")),
            point.value
        )
    };
    Some(Verdict {
        sweep,
        method,
        course: format!("{}; {}", state(first), state(last)),
        breaks,
    })
}

fn broken(limit: &'static Limit, values: &[f64], points: &[Point]) -> Option<Break> {
    let mut runs: Vec<[f64; 2]> = Vec::new();
    let mut worst = [limit.bound, f64::NAN];
    let mut last_index = None;
    for (index, value) in values.iter().enumerate() {
        let point = points.iter().find(|point| point.value == *value);
        let Some(measure) = point.and_then(|point| (limit.of)(point)) else {
            continue;
        };
        if measure <= limit.bound {
            continue;
        }
        match runs.last_mut() {
            Some(run) if last_index == index.checked_sub(1) => run[1] = *value,
            _ => runs.push([*value, *value]),
        }
        last_index = Some(index);
        if measure > worst[0] {
            worst = [measure, *value];
        }
    }
    (!runs.is_empty()).then_some(Break {
        limit,
        runs,
        worst: worst[0],
        worst_at: worst[1],
    })
}

/// Known reasons, by sweep and method, without the full stop.
fn reason(sweep: &str, method: &str) -> Option<&'static str> {
    Some(match (method, sweep) {
        ("footprint", "curvature") => {
            "A patch of the half sphere turns the light by several degrees, so that its image is no \
             longer an affine one: the kernel is symmetric where the image is longer on its outer side. The \
             error falls with the area of the patches"
        }
        ("footprint", "bumps") => {
            "From some four patches a wave on, neighbouring patches send the light far apart, and the \
             kernels, rounder and wider than the images of triangles, do not join up to the pattern of \
             facets that the reference sees. Finer meshes cure it, more patches a triangle help"
        }
        ("footprint", "turning") => {
            "Each footprint moves smoothly, so the flicker is that of its slow ripple over the patches, and \
             of the reference's noise (0.4 % at most)"
        }
        ("footprint", "sun" | "light-map") => {
            "Where the sun and a texel are smaller than a patch's image, the blur of the patch is what is \
             left; more patches cure it"
        }
        ("beams", _) => {
            "Light is drawn as if it came from the middle of the sun alone: what the sun's width should \
             blur stays sharp, the more the farther the receiver is"
        }
        ("points", "curvature") => {
            "Points are even on the mirror, and of a small sphere only the light of its very top reaches \
             the screen, or few of its points do: noise"
        }
        ("points", "turning") => {
            "A point counts for one texel, so it jumps from texel to texel. Flicker falls with the number \
             of points as the error does"
        }
        ("points", "suns") => "The suns share the points, and every sun's are a coarser set: noise",
        ("points", _) => {
            "Noise: too few points a texel where the light spreads over many. Four times as many texels \
             or as wide a light need four times as many points"
        }
        ("pinhole", "focus") => {
            "It looks up the light at texel centres and once a patch. In the focus all patches send a point \
             of light to one point, which no texel centre hits, and around it the hits are as coarse \
             as the patches"
        }
        ("pinhole", "contact-face" | "contact-edge") => {
            "ε in d² + ε, of the patch's size, caps the form factor as soon as patches are as large as \
             their distance: the energy goes to zero with the gap"
        }
        ("pinhole", "curvature" | "grazing") => {
            "Light is looked up once a patch and at texel centres; the filter by curvature is first order"
        }
        ("pinhole", "bumps") => {
            "Patches as large as the bumps are looked up with the one filter of their middle"
        }
        ("pinhole", "turning") => {
            "Every patch shows a blurred disc that jumps past texel centres as the mirror turns"
        }
        ("pinhole", _) => {
            "The ring stands on the floor, where ε in d² + ε takes light away, and 1024 patches, looked up \
             once each, are coarse"
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(value: f64, l1: Option<f64>) -> Point {
        Point {
            value,
            samples: 1,
            light_map: 8,
            l1,
            energy_ratio: Some(1.0),
            overshoot: None,
            bad_texels: 0,
            flicker: None,
            drift: None,
        }
    }

    #[test]
    fn runs_of_neighbours_are_told_together() {
        let values = [1.0, 0.3, 0.1, 0.03, 0.01];
        let l1 = [0.06, 0.01, 0.07, 0.2, 0.05];
        let points: Vec<Point> = (values.iter().zip(l1))
            .map(|(v, l1)| point(*v, Some(l1)))
            .collect();
        let limit = LIMITS.iter().find(|limit| limit.name == "L1").unwrap();
        let found = broken(limit, &values, &points).unwrap();
        assert_eq!(
            found.sentence(),
            "L1 above 5 % at 1, 0.1 to 0.03 (worst 20.0 % at 0.03)"
        );
        assert!(broken(limit, &values, &points[4..]).is_none());
        // What was not measured breaks nothing, and parts neighbours.
        let mut gap = points.clone();
        gap.remove(2);
        assert_eq!(broken(limit, &values, &gap).unwrap().runs.len(), 2);
        gap[0].l1 = None;
        assert_eq!(broken(limit, &values, &gap).unwrap().runs, [[0.03, 0.03]]);
    }

    #[test]
    fn a_bad_texel_breaks() {
        let mut bad = point(1.0, None);
        bad.bad_texels = 1;
        let found = broken(&LIMITS[0], &[1.0], &[bad]).unwrap();
        assert_eq!(found.sentence(), "bad texels at 1 (worst 1.56 % at 1)");
        assert!(broken(&LIMITS[0], &[1.0], &[point(1.0, None)]).is_none());
    }
}
