//! Large pictures and light maps are computed in parts, each a submission of its own where it is
//! large: a watchdog takes the device away from a program whose submission runs for seconds.

use crate::error::Result;
use crate::gpu::Recorder;
use glam::UVec2;

/// Rays of one submission: a second on a device that traces 60 million a second.
const MOST_RAYS: u64 = 1 << 26;
/// Sides of a workgroup.
const GROUP: u32 = 8;

/// A rectangle of pixels or texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    pub first: UVec2,
    /// Workgroups of 8 × 8; what they cover beyond the picture is left out by the shader.
    pub groups: [u32; 3],
    /// At most.
    pub rays: u64,
}

impl Part {
    /// For [`Recorder::dispatch`].
    pub fn threads(&self) -> [u32; 3] {
        let [x, y, z] = self.groups;
        [GROUP * x, GROUP * y, z]
    }
}

/// The parts of a picture of `size` pixels with `rays` rays each, from the top row.
pub fn parts([width, height]: [u32; 2], rays: u64) -> impl Iterator<Item = Part> {
    let area = u64::from(GROUP * GROUP);
    let groups = (MOST_RAYS / (area * rays.max(1))).max(1);
    let whole = [width, height].map(|side| side.div_ceil(GROUP));
    let columns = groups.min(whole[0].into()) as u32;
    let rows = (groups / u64::from(columns)).min(whole[1].into()) as u32;
    let starts = move |row| {
        (0..whole[0])
            .step_by(columns as usize)
            .map(move |x| [x, row])
    };
    (0..whole[1])
        .step_by(rows as usize)
        .flat_map(starts)
        .map(move |[x, y]| {
            let groups = [columns.min(whole[0] - x), rows.min(whole[1] - y), 1];
            Part {
                first: GROUP * UVec2::new(x, y),
                groups,
                rays: rays * area * u64::from(groups[0]) * u64::from(groups[1]),
            }
        })
}

/// (first, number) of the runs of at most `most` things that `count` things are worked through in.
pub fn batches(count: u32, most: u32) -> impl Iterator<Item = (u32, u32)> {
    (0..count)
        .step_by(most.max(1) as usize)
        .map(move |first| (first, most.min(count - first)))
}

/// Rays recorded since the last submission.
#[derive(Default)]
pub struct Load(u64);

impl Load {
    /// Submits first where `rays` more would be too many.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn add(&mut self, recorder: &mut Recorder, rays: u64) -> Result<()> {
        if self.0 > 0 && self.0 + rays > MOST_RAYS {
            recorder.submit()?;
            self.0 = 0;
        }
        self.0 += rays;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_cover_a_picture_once_and_stay_small() {
        for (size, rays, most_parts) in [
            ([1280, 720], 20, 1),
            ([1, 1], 1_000_000_000, 1),
            ([100, 60], 1_000_000, 13 * 8),
            ([16384, 16384], 20, 100),
            ([16384, 9], 8464, 34),
        ] {
            let [columns, rows] = size.map(|side: u32| side.div_ceil(GROUP) as usize);
            let mut covered = vec![0u8; columns * rows];
            let mut count = 0;
            for part in parts(size, rays) {
                let [x, y] = part.first.to_array().map(|at| (at / GROUP) as usize);
                for row in y..y + part.groups[1] as usize {
                    for column in x..x + part.groups[0] as usize {
                        covered[row * columns + column] += 1;
                    }
                }
                let one_group = part.groups == [1, 1, 1];
                assert!(part.rays <= MOST_RAYS || one_group, "{part:?}");
                count += 1;
            }
            assert!(covered.iter().all(|times| *times == 1), "{size:?}");
            assert!(count <= most_parts, "{size:?}: {count}");
        }
    }
}
