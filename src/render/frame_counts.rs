//! Counts of a host's frames: copied to the host at the end of a frame, and read when the host has waited for the frame.

use crate::error::Result;
use crate::gpu::{Access, Buffer, Context, Readback, Recorder};
use crate::render::caustic::Caustic;
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::ReceiverShare;
use crate::render::gpu_types::constants::{
    ARGUMENT_WORDS, SECOND_UNITS_WORD, UNITS_WORD, WAVE_DRAW_WORD, WAVE_WORDS,
};
use crate::render::settings::EXPECTED_ERROR;
use std::collections::VecDeque;
use std::sync::Arc;

/// Words of a splat list's arguments, and the word of the number of splats.
const LIST_WORDS: usize = 7;
const LIST_SPLATS_WORD: usize = 5;

/// What the last caustic of a frame consists of. A frame that keeps the caustic of an earlier one has that one's counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct FrameCounts {
    /// Patches, once for each light where they follow the light, with the patch clusters of the environment; or points.
    pub patches: u32,
    /// Places on the casters from which rays tested the visibility of the light and of the receivers, under suns and lamps on
    /// planar receivers. Rays of chains, of other splats and of direct light are not counted.
    pub traced_corners: u32,
    /// Splats that were added to the light maps: triangles and kernels; of chains, the slots in use. `None` for methods without
    /// splats, and for points.
    pub splats: Option<u32>,
    /// Estimated relative L1 error on the planar receiver where it is largest; `None` where [`super::Renderer::estimated_error`]
    /// has none.
    pub error: Option<f32>,
}

/// A kind of words that a frame copied.
#[derive(Clone, Copy)]
enum Part {
    Patches { corners: u32 },
    Triangles,
    Errors,
    List,
    Chains,
}

/// What a frame in flight copies.
struct Copied {
    readback: Readback,
    /// Kinds of words with their numbers, in order.
    parts: Vec<(Part, usize)>,
    /// The counts that the host knows.
    known: FrameCounts,
}

/// Copies the counts of frames.
pub struct Counter {
    /// Whether frames are counted; if not, those in flight still copy to its memory.
    pub is_on: bool,
    /// The last frames; `None` where one was not counted.
    in_flight: VecDeque<Option<Copied>>,
    unused: Vec<Readback>,
}

impl Counter {
    /// For frames of which `frames` may be in flight.
    pub fn new(frames: usize) -> Self {
        Self {
            is_on: true,
            in_flight: std::iter::repeat_with(|| None).take(frames).collect(),
            unused: Vec::new(),
        }
    }

    /// Whether no frame in flight uses its memory.
    pub fn is_idle(&self) -> bool {
        self.in_flight.iter().all(Option::is_none)
    }

    /// Begins a frame; the counts of the frame that has ended for it, if that one was counted.
    pub fn begin(&mut self) -> Option<FrameCounts> {
        let ended = self.in_flight.pop_front().flatten();
        self.in_flight.push_back(None);
        let mut copied = ended?;
        let total = copied.parts.iter().map(|(_, count)| count).sum();
        let words = copied.readback.words(total);
        let mut counts = copied.known;
        let mut rest = words.as_slice();
        for (part, count) in copied.parts {
            let (own, others) = rest.split_at(count);
            rest = others;
            let mut add = |splats: u32| {
                counts.splats = counts.splats.map(|sum| sum.saturating_add(splats));
            };
            match part {
                Part::Patches { corners } => {
                    counts.patches += own[UNITS_WORD as usize];
                    counts.traced_corners = match corners {
                        0 => 0,
                        _ => corners + own[SECOND_UNITS_WORD as usize],
                    };
                }
                Part::Triangles => add(own[UNITS_WORD as usize]),
                Part::List => add(own[LIST_SPLATS_WORD]),
                // Six indices for each footprint.
                Part::Chains => add(own[WAVE_DRAW_WORD as usize] / 6),
                Part::Errors => {
                    let shares: &[ReceiverShare] = bytemuck::cast_slice(own);
                    let largest = shares.iter().map(|share| share.error).reduce(f32::max);
                    counts.error = largest.map(|error| EXPECTED_ERROR * error);
                }
            }
        }
        self.unused.push(copied.readback);
        Some(counts)
    }

    /// The host does not submit the last frame.
    pub fn forget_last(&mut self) {
        // It does not count as one: those before it may still be in flight.
        let last = self.in_flight.pop_back().flatten();
        self.unused.extend(last.map(|copied| copied.readback));
        self.in_flight.push_front(None);
    }

    /// Copies the counts of the frame that is recorded.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where memory is insufficient.
    pub fn record(
        &mut self,
        context: &Arc<Context>,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        caustic: &Caustic,
    ) -> Result<()> {
        let (known, sources) = sources(scene, caustic);
        let total = sources.iter().map(|(_, _, count)| count).sum();
        let readback = match self.unused.pop().filter(|own| own.capacity() >= total) {
            Some(readback) => readback,
            None => Readback::new(context, total)?,
        };
        recorder.pass("copy counts", |r| {
            r.barrier(Access::ANY_WRITE, Access::TRANSFER_READ);
            let mut first = 0;
            for (_, buffer, count) in &sources {
                r.copy_words(buffer, &readback, first, *count);
                first += count;
            }
            r.barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
        })?;
        let parts = sources.iter().map(|(part, _, count)| (*part, *count));
        let copied = Copied {
            readback,
            parts: parts.collect(),
            known,
        };
        if let Some(last) = self.in_flight.back_mut() {
            *last = Some(copied);
        }
        Ok(())
    }
}

/// The counts that the host knows, and the buffers with the others: kinds and numbers of words.
fn sources<'a>(
    scene: &DeviceScene,
    caustic: &'a Caustic,
) -> (FrameCounts, Vec<(Part, &'a Buffer, usize)>) {
    let mut known = FrameCounts {
        patches: caustic.known_patches(scene),
        ..FrameCounts::default()
    };
    let mut sources = Vec::new();
    match caustic {
        Caustic::Points(_) | Caustic::Gather { .. } => {}
        Caustic::Splat {
            triangles,
            chains,
            projectors,
            ..
        } => {
            known.splats = Some(0);
            if let Some(of) = triangles {
                let corners = match scene.geometry.can_occlude && of.traces_corners {
                    true => scene.facets.corners()[1] * scene.lights.part_count,
                    false => 0,
                };
                let words = ARGUMENT_WORDS as usize;
                sources.push((Part::Patches { corners }, &of.patch_totals, words));
                sources.push((Part::Triangles, &of.splat_totals, words));
                if of.has_error_target() && projectors.is_empty() {
                    let words = of.shares.bytes() as usize / 4;
                    sources.push((Part::Errors, &of.shares, words));
                }
            }
            if let Some(chains) = chains {
                sources.push((Part::Chains, chains.last(), WAVE_WORDS as usize));
            }
            for projector in projectors {
                sources.push((Part::List, &projector.list.arguments, LIST_WORDS));
            }
        }
    }
    (known, sources)
}
