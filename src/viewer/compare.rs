//! The comparison of two sides: what of it is shown, and how much the sides differ.

use super::technique::Technique;
use nephroid::scene::Scene;
use serde::Serialize;

/// The automatic scale of the heat map, in root mean square differences of the pictures.
const SCALE: f64 = 3.0;
/// The least automatic scale: equal pictures have no differences to scale.
const LEAST_SCALE: f64 = 1e-6;

/// What fills the window.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shown {
    /// Side A.
    One,
    /// A left of the divider, which is a share of the window's width, and B right of it.
    Split { divider: f32 },
    /// The difference of the pictures. `scale` is what the last colour stands for: W/m²/sr, or relative to B.
    HeatMap { scale: f64, is_relative: bool },
}

/// How far A is from B, by the definitions of `compare`; `None` where it would divide by a black B.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Object whose light map it is of; `None`: the picture.
    pub receiver: Option<usize>,
    pub l1: Option<f64>,
    pub energy_ratio: Option<f64>,
    /// Root mean square of what the heat map shows.
    pub rms: f64,
}

impl Difference {
    /// From the sums of |A − B|, B, squared differences and A over so many texels.
    pub fn of(receiver: Option<usize>, [l1, b, squares, a]: [f64; 4], texels: f64) -> Self {
        let over_b = |sum: f64| (b > 0.0).then(|| sum / b).filter(|ratio| ratio.is_finite());
        Self {
            receiver,
            l1: over_b(l1),
            energy_ratio: over_b(a),
            rms: (squares / texels).sqrt(),
        }
    }

    pub fn name<'a>(&self, scene: &'a Scene) -> &'a str {
        let object = self.receiver.and_then(|index| scene.objects.get(index));
        object.map_or("picture", |object| &object.name)
    }
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct HeatMap {
    pub is_on: bool,
    /// Whether it shows differences relative to B.
    pub is_relative: bool,
    /// What its last colour stands for; `None` follows the differences.
    pub scale: Option<f64>,
}

#[derive(Debug, Clone)]
pub struct Compare {
    pub is_on: bool,
    /// How A and B compute their caustics.
    pub techniques: [Technique; 2],
    /// Share of the window's width.
    pub divider: f32,
    pub heat_map: HeatMap,
    /// Of the last pictures that were measured: the picture's, then those of the light maps.
    pub differences: Vec<Difference>,
    /// Expected L1 errors of the reference, by the objects of its light maps.
    pub reference: Vec<(usize, f64)>,
}

impl Compare {
    /// B begins as A.
    pub fn new(technique: Technique) -> Self {
        Self {
            is_on: false,
            techniques: [technique; 2],
            divider: 0.5,
            heat_map: HeatMap::default(),
            differences: Vec::new(),
            reference: Vec::new(),
        }
    }

    /// The techniques of the sides that are shown.
    pub fn sides(&self) -> &[Technique] {
        &self.techniques[..if self.is_on { 2 } else { 1 }]
    }

    /// Whether a side that is shown is the reference.
    pub fn has_reference(&self) -> bool {
        self.sides().iter().any(|side| side.is_reference)
    }

    pub fn shown(&self) -> Shown {
        match (self.is_on, self.heat_map.is_on) {
            (false, _) => Shown::One,
            (true, false) => Shown::Split {
                divider: self.divider,
            },
            (true, true) => Shown::HeatMap {
                scale: self.scale(),
                is_relative: self.heat_map.is_relative,
            },
        }
    }

    /// Shows the heat map of a comparison, which begins if there is none, or the sides again.
    pub fn toggle_heat_map(&mut self) {
        self.heat_map.is_on = !(self.is_on && self.heat_map.is_on);
        self.is_on = true;
    }

    /// What the heat map's last colour stands for.
    pub fn scale(&self) -> f64 {
        let automatic = || {
            let rms = self.differences.first().map_or(0.0, |picture| picture.rms);
            round_up((SCALE * rms).max(LEAST_SCALE))
        };
        self.heat_map.scale.unwrap_or_else(automatic)
    }

    /// The differences, and the errors of the reference, in words.
    pub fn lines(&self, scene: &Scene) -> Vec<String> {
        let line = |difference: &Difference| {
            let l1 =
                (difference.l1).map_or("undefined".into(), |l1| format!("{:.4} %", 100.0 * l1));
            let ratio = (difference.energy_ratio)
                .map_or(String::new(), |ratio| format!(", energy ratio {ratio:.4}"));
            format!("{}: L1 {l1}{ratio}", difference.name(scene))
        };
        let of_reference = |(receiver, error): &(usize, f64)| {
            let object = scene.objects.get(*receiver);
            let name = object.map_or("", |object| &object.name);
            format!("{name}: reference ± {:.2} %", 100.0 * error)
        };
        let waits = self.has_reference() && self.reference.is_empty();
        let waiting = waits.then(|| "the reference begins".to_owned());
        (self.differences.iter().map(line))
            .chain(waiting)
            .chain(self.reference.iter().map(of_reference))
            .collect()
    }
}

/// The next number of 1, 2 and 5 times a power of ten, so that a scale that follows a scene seldom changes.
fn round_up(value: f64) -> f64 {
    if !value.is_finite() {
        return 1.0;
    }
    let power = 10f64.powf(value.log10().floor());
    // The power itself is rounded.
    let digits = value / power * (1.0 - 1e-9);
    let step = [1.0, 2.0, 5.0].into_iter().find(|step| digits <= *step);
    step.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round() {
        for (value, expected) in [
            (0.9, 1.0),
            (1.0, 1.0),
            (1.1, 2.0),
            (0.03, 0.05),
            (700.0, 1e3),
        ] {
            assert!((round_up(value) / expected - 1.0).abs() < 1e-6, "{value}");
        }
        assert_eq!(round_up(f64::NAN), 1.0);
    }

    #[test]
    fn differences_are_those_of_compare() {
        // A: 1 3, B: 1 2 of one channel.
        let difference = Difference::of(None, [1.0, 3.0, 1.0, 4.0], 2.0);
        assert_eq!(difference.l1, Some(1.0 / 3.0));
        assert_eq!(difference.energy_ratio, Some(4.0 / 3.0));
        assert_eq!(Difference::of(None, [1.0, 0.0, 1.0, 1.0], 1.0).l1, None);
    }
}
