//! Dispatch tiling: images are computed in rectangles of workgroups, so that no submission runs long.

use crate::render::gpu_types::constants::{GROUP_SIDE, MAX_ROW, SPLAT_GROUP};
use glam::UVec2;
use std::ops::Range;

/// Rays in a first submission, before the speed of the device is known: 20 ms on two CPU cores.
const FIRST_RAYS: u64 = 1 << 17;

/// A rectangle of pixels or texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroupRect {
    pub first: UVec2,
    /// Workgroups of 8 × 8. The shader skips threads outside the image.
    pub groups: [u32; 3],
}

impl GroupRect {
    /// The largest rectangle of workgroups that starts at workgroup `first` and has at most `max_groups`. Workgroups
    /// cover `size` pixels and are counted row by row.
    pub fn of([width, height]: [u32; 2], first: u64, max_groups: u64) -> Self {
        let [columns, rows] = [width, height].map(|side| side.div_ceil(GROUP_SIDE));
        let row = (first / u64::from(columns)) as u32;
        let column = (first % u64::from(columns)) as u32;
        let max_groups = max_groups.min(u64::from(columns) * u64::from(rows)) as u32;
        let groups = if column == 0 && max_groups >= columns {
            [columns, (max_groups / columns).min(rows - row), 1]
        } else {
            [max_groups.min(columns - column), 1, 1]
        };
        Self {
            first: GROUP_SIDE * UVec2::new(column, row),
            groups,
        }
    }

    /// Number of workgroups.
    pub fn count(&self) -> u64 {
        self.groups.map(u64::from).iter().product()
    }

    /// For [`crate::gpu::Recorder::dispatch`].
    pub fn threads(&self) -> [u32; 3] {
        let [x, y, z] = self.groups;
        [GROUP_SIDE * x, GROUP_SIDE * y, z]
    }
}

/// Threads of a dispatch over `units`, in as many rows of workgroups as the device needs.
pub fn threads(units: u32) -> [u32; 3] {
    let groups = units.div_ceil(SPLAT_GROUP);
    let columns = groups.min(MAX_ROW);
    [columns * SPLAT_GROUP, groups.div_ceil(columns.max(1)), 1]
}

/// Number of workgroups that cover `size` pixels.
pub fn group_count([width, height]: [u32; 2]) -> u64 {
    u64::from(width.div_ceil(GROUP_SIDE)) * u64::from(height.div_ceil(GROUP_SIDE))
}

/// Number of workgroups, each pixel with `rays` rays, that every device computes in a short time.
pub fn first_groups(rays: u64) -> u64 {
    (FIRST_RAYS / (u64::from(GROUP_SIDE * GROUP_SIDE) * rays.max(1))).max(1)
}

/// Bands of rows of an image, with at most `texels` texels or one row each.
pub fn bands([width, height]: [u32; 2], texels: u32) -> impl ExactSizeIterator<Item = Range<u32>> {
    let rows = (texels / width).max(1);
    (0..height.div_ceil(rows)).map(move |band| band * rows..((band + 1) * rows).min(height))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_an_image_once() {
        let found: Vec<_> = bands([100, 25], 1000).collect();
        assert_eq!(found, [0..10, 10..20, 20..25]);
        assert_eq!(bands([100, 3], 1).len(), 3);
        assert_eq!(bands([100, 3], 1 << 20).collect::<Vec<_>>(), vec![0..3; 1]);
    }

    #[test]
    fn rects_cover_an_image_once() {
        for (size, max_groups) in [
            ([1280, 720], 1_000_000),
            ([1, 1], 5),
            ([100, 60], 1),
            ([100, 60], 13),
            ([1000, 60], 300),
            ([16_384, 9], 700),
        ] {
            let [columns, rows] = size.map(|side: u32| side.div_ceil(GROUP_SIDE) as usize);
            let mut covered = vec![0u8; columns * rows];
            let (mut first, total) = (0, group_count(size));
            assert_eq!(total as usize, columns * rows);
            while first < total {
                let rect = GroupRect::of(size, first, max_groups);
                assert!((1..=max_groups).contains(&rect.count()), "{rect:?}");
                let [x, y] = rect.first.to_array().map(|at| (at / GROUP_SIDE) as usize);
                for row in y..y + rect.groups[1] as usize {
                    for column in x..x + rect.groups[0] as usize {
                        covered[row * columns + column] += 1;
                    }
                }
                first += rect.count();
            }
            assert!(covered.iter().all(|times| *times == 1), "{size:?}");
        }
    }
}
