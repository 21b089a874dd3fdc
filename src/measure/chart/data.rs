//! A chart as plain data.

use super::strip::Strip;
use crate::error::{Error, Result};
use crate::measure::profile::Spread;
use serde::{Deserialize, Serialize};

/// Version of [`Chart`]'s JSON, raised when a field changes its meaning or goes.
pub const SCHEMA: u32 = 1;

/// Measurements on one device, so software and hardware devices never share axes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Chart {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of this crate.
    pub nephroid: String,
    /// Of the source tree, where it is known.
    pub commit: Option<String>,
    /// ISO 8601.
    pub date: String,
    /// Name of the Vulkan device.
    pub device: String,
    /// Name and version of its driver.
    pub driver: String,
    /// Model name of the CPU.
    pub cpu: String,
    pub kind: DeviceKind,
    pub scenes: Vec<SceneChart>,
}

/// What executes the shaders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DeviceKind {
    /// The CPU, as lavapipe and SwiftShader do.
    Software,
    /// A GPU.
    Hardware,
}

/// All methods on one receiver of one scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SceneChart {
    pub scene: String,
    /// Object whose light map is compared.
    pub receiver: String,
    /// Its width and height, texels.
    pub light_map: [u32; 2],
    /// L1 error that the reference itself is expected to have, relative; 0 for a closed form.
    pub reference_error: f64,
    pub series: Vec<Series>,
    pub peers: Vec<Peer>,
    pub strips: Vec<Strip>,
    /// What the curves say, for a reader: a sentence each.
    pub verdicts: Vec<String>,
}

/// One method at several settings, in the order in which its curve is drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// Names the method in the legend, like `footprint` or `pinhole, ε = 0`; unique in a scene.
    pub label: String,
    pub points: Vec<Point>,
}

/// One method at one setting.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Number of patches, or of points on the casters.
    pub samples: u64,
    /// Width and height, texels.
    pub light_map: [u32; 2],
    /// Everything else that was set, for a reader.
    pub settings: String,
    /// Σ|A − B| / ΣB against the reference B, relative.
    pub l1: f64,
    /// √(Σ(A − B)² / ΣB²), relative.
    pub l2: f64,
    /// ΣA / ΣB.
    pub energy_ratio: f64,
    /// Wall time of one update of the light map.
    pub wall: Spread,
    /// The same between the device's timestamps; `None` where it has none.
    pub gpu: Option<Spread>,
    /// False where `l1` is not clearly more than the reference's own error, and so only a bound.
    pub above_floor: bool,
    /// What a reader should know besides.
    pub note: Option<String>,
}

/// One measurement of another renderer, as its user reports it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Peer {
    pub name: String,
    pub version: String,
    /// Device or CPU that did the work, as [`Chart::device`] or [`Chart::cpu`] spell it.
    pub hardware: String,
    pub scene: String,
    /// Wall time, s.
    pub seconds: f64,
    /// L1 error against the same reference, relative.
    pub error: f64,
    #[serde(default)]
    pub note: Option<String>,
}

impl Peer {
    /// Name and version.
    pub(super) fn title(&self) -> String {
        format!("{} {}", self.name, self.version).trim().to_owned()
    }
}

impl Chart {
    /// Whether `peer` was measured on this chart's device or CPU, so that times compare.
    pub fn is_local(&self, peer: &Peer) -> bool {
        let words = |text: &str| -> Vec<String> {
            text.split_whitespace().map(str::to_lowercase).collect()
        };
        let hardware = words(&peer.hardware);
        hardware == words(&self.device) || hardware == words(&self.cpu)
    }

    /// Refuses what logarithmic axes cannot show.
    pub(super) fn check(&self) -> Result<()> {
        let refuse = |scene: &SceneChart, what: String| {
            Err(Error::Usage {
                reason: format!("scene {}: {what}", scene.scene),
                remedy:
                    "measure again against a reference that is neither black nor the same image"
                        .into(),
            })
        };
        let positive = |value: f64| value.is_finite() && value > 0.0;
        for scene in &self.scenes {
            if !(scene.reference_error.is_finite() && scene.reference_error >= 0.0) {
                return refuse(
                    scene,
                    format!("the reference's own error is {}", scene.reference_error),
                );
            }
            if scene.series.iter().all(|series| series.points.is_empty()) {
                return refuse(scene, "nothing was measured".into());
            }
            for peer in &scene.peers {
                if !(positive(peer.seconds) && positive(peer.error)) {
                    let what = "has a time or an error that is not positive and finite";
                    return refuse(scene, format!("{} {what}", peer.title()));
                }
            }
            for series in &scene.series {
                for (index, point) in series.points.iter().enumerate() {
                    let ordered = |time: &Spread| {
                        positive(time.p05)
                            && time.p95.is_finite()
                            && time.p05 <= time.median
                            && time.median <= time.p95
                    };
                    let good = positive(point.l1)
                        && point.l2.is_finite()
                        && point.energy_ratio.is_finite()
                        && ordered(&point.wall)
                        && point.gpu.as_ref().is_none_or(ordered);
                    if !good {
                        return refuse(
                            scene,
                            format!(
                                "point {} of {} has an error or a time that is not positive and \
                                 finite: L1 {}, wall {} s",
                                index + 1,
                                series.label,
                                point.l1,
                                point.wall.median
                            ),
                        );
                    }
                }
            }
        }
        if self.scenes.is_empty() {
            return Err(Error::Usage {
                reason: "the chart has no scene".into(),
                remedy: "name at least one scene".into(),
            });
        }
        Ok(())
    }
}

/// Indices of the points (time, error) that no other beats in one without losing in the other,
/// by rising time. Equal points are all on the front. The values are finite.
pub fn pareto(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| {
        let [a, b] = [points[a], points[b]];
        a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
    });
    let mut front: Vec<usize> = Vec::new();
    for index in order {
        let best = front.last().map(|&last| points[last]);
        if best.is_none_or(|best| points[index][1] < best[1] || points[index] == best) {
            front.push(index);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_front_keeps_ties_and_drops_what_is_beaten() {
        let points = [
            [4.0, 1.0], // 0: on the front
            [1.0, 9.0], // 1: on the front
            [4.0, 2.0], // 2: as slow as 0, worse
            [5.0, 1.0], // 3: as good as 0, slower
            [2.0, 3.0], // 4: on the front
            [2.0, 3.0], // 5: the same again
            [3.0, 8.0], // 6: beaten by 4
        ];
        assert_eq!(pareto(&points), [1, 4, 5, 0]);
        assert_eq!(pareto(&points[..1]), [0]);
        assert!(pareto(&[]).is_empty());
    }
}
