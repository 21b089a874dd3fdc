//! Cells of about equal flux, to which diffuse surfaces have shadow rays.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::environment::cell::EnvironmentCell;
use crate::render::environment::cells::divide_by_flux;
use crate::render::gpu_types::DirectCell;
use crate::render::gpu_types::constants::{DIRECT_CELLS, DIRECT_CELLS_SIDE};
use crate::render::lights::EnvironmentLight;
use std::sync::Arc;

/// Cells for points of meshes, each of which has rays to all of them.
pub const POINT_CELLS: u32 = 64;

pub struct DirectCells {
    /// [`DIRECT_CELLS`] cells, then [`POINT_CELLS`] others.
    pub buffer: Buffer,
    cells: [Vec<EnvironmentCell>; 2],
}

impl DirectCells {
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        let bytes = size_of::<DirectCell>() as u64 * u64::from(DIRECT_CELLS + POINT_CELLS);
        Ok(Self {
            buffer: Buffer::new(context, "direct cells", bytes)?,
            cells: Default::default(),
        })
    }

    /// Writes the cells of an environment; `is_another`: of another map than before.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        staging: &mut Staging,
        light: &EnvironmentLight,
        is_another: bool,
    ) -> Result<()> {
        if is_another {
            let counts = [DIRECT_CELLS, POINT_CELLS].map(|count| count as usize);
            self.cells = divide_by_flux(light.map, counts);
            for (cells, count) in self.cells.iter_mut().zip(counts) {
                order_by_place(cells, count);
            }
        }
        let mut all = Vec::new();
        for (cells, count) in self.cells.iter().zip([DIRECT_CELLS, POINT_CELLS]) {
            let first = all.len();
            all.extend((0u32..).zip(cells).map(|(index, cell)| {
                cell.direct_cell(light.scale, light.rotation, place_in_cell(index))
            }));
            // What is missing is dark.
            all.resize(first + count as usize, DirectCell::default());
        }
        staging.write(&self.buffer, 0, &all)
    }
}

/// Orders cells so that each half of `count` of them is close together, and each half of these, and so on.
fn order_by_place(cells: &mut [EnvironmentCell], count: usize) {
    if cells.len() < 2 {
        return;
    }
    let extent = |axis: usize| {
        let places = || cells.iter().map(|cell| cell.direction(0.0)[axis]);
        places().fold(f64::MIN, f64::max) - places().fold(f64::MAX, f64::min)
    };
    let widest = (0..3).max_by(|&a, &b| extent(a).total_cmp(&extent(b)));
    let axis = widest.expect("three axes");
    cells.sort_by(|a, b| a.direction(0.0)[axis].total_cmp(&b.direction(0.0)[axis]));
    let (low, high) = cells.split_at_mut((count / 2).min(cells.len()));
    order_by_place(low, count / 2);
    order_by_place(high, count / 2);
}

/// Place of the shadow ray of a cell, from −1 to 1 across and up. Rays to the centres would be in rows, and edges along these
/// would cast shadows with steps. Cells of a texel are [`DIRECT_CELLS_SIDE`]² apart; so that their places differ, these are numbered
/// texel by texel. The sequence R2 of Roberts (2018).
fn place_in_cell(index: u32) -> [f64; 2] {
    let subsets = DIRECT_CELLS_SIDE * DIRECT_CELLS_SIDE;
    let number = index % subsets * (DIRECT_CELLS / subsets) + index / subsets;
    [0.754_877_666_246_693, 0.569_840_290_998_053]
        .map(|step| 2.0 * (0.5 + f64::from(number) * step).fract() - 1.0)
}
