//! Sizes of light maps, where a scene leaves them to the renderer.

use crate::error::Result;
use crate::gpu::Context;
use crate::image_file::RgbImage;
use crate::render::{DEFAULT_ERROR, Method, Renderer, Settings};
use crate::scene::Scene;
use serde::Serialize;
use std::sync::Arc;

/// Minimum and maximum width and height of a chosen light map, texels.
const SIDES: [f64; 2] = [16.0, 1024.0];
/// A size is settled once the next one differs by less than this factor.
const SETTLED: f64 = 1.1;
/// Renderings at most.
const ROUNDS: usize = 5;
/// The error of a map over its difference from a map of half the width and height, at most, as measured on shipped scenes (0.5 to 0.8).
const SHARE_OF_DIFFERENCE: f64 = 0.8;

/// A light map whose size was chosen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChosenLightMap {
    /// Index into [`Scene::objects`].
    #[serde(skip)]
    pub object: usize,
    /// Name of the object.
    #[serde(rename = "object")]
    pub name: String,
    /// Width and height, texels.
    pub texels: [u32; 2],
    /// Estimated relative L1 difference between the map, interpolated, and the caustic.
    pub unresolved: f64,
}

/// Chooses the sizes of the light maps of `objects`, so that what texels do not resolve of the caustic in `scene` is at most the error
/// that the settings aim for (2 % if they aim for none) of each receiver's light, or as little as 1024 texels on the longer side allow.
/// The scene's own sizes give the proportions.
///
/// # Errors
/// [`crate::Error::Usage`] where the scene cannot be rendered, and [`crate::Error::Device`] where the device fails.
pub fn choose_light_maps(
    context: &Arc<Context>,
    scene: &Scene,
    objects: &[usize],
    settings: &Settings,
) -> Result<Vec<ChosenLightMap>> {
    let mut scene = scene.clone();
    let mut unresolved = vec![0.0; objects.len()];
    let error = settings.error.unwrap_or(DEFAULT_ERROR);
    // Methods differ in speed, but not in what they compute.
    let settings = Settings {
        method: Method::Footprint,
        error: Some(error),
        budget: None,
        ..settings.clone()
    };
    for _ in 0..ROUNDS {
        let mut renderer = Renderer::new(context, &scene, &settings)?;
        renderer.caustic()?;
        let mut is_settled = true;
        for (&object, unresolved) in objects.iter().zip(&mut unresolved) {
            let map = renderer.read_caustic(object)?;
            let size = [map.width, map.height].map(f64::from);
            *unresolved = SHARE_OF_DIFFERENCE * detail(&map);
            let factor = *unresolved / f64::from(error);
            let largest = SIDES[1] / size[0].max(size[1]);
            let smallest = SIDES[0] / size[0].min(size[1]);
            let factor = factor.max(smallest).min(largest);
            if factor.max(1.0 / factor) > SETTLED {
                is_settled = false;
                // Even, so that halves are whole.
                let side = |side: f64| 2 * ((0.5 * factor * side).round().max(1.0) as u32);
                scene.objects[object].light_map = Some(size.map(side));
                *unresolved /= factor;
            }
        }
        if is_settled {
            break;
        }
    }
    let chosen = |(&index, unresolved): (&usize, f64)| {
        let object = &scene.objects[index];
        ChosenLightMap {
            object: index,
            name: object.name.clone(),
            texels: object.light_map.unwrap_or_default(),
            unresolved,
        }
    };
    Ok(objects.iter().zip(unresolved).map(chosen).collect())
}

/// L1 difference of a map from one of half its width and height, interpolated, over its light. A last odd row or column does not count.
fn detail(map: &RgbImage) -> f64 {
    let [width, height] = [map.width as usize / 2, map.height as usize / 2];
    if width == 0 || height == 0 {
        return 0.0;
    }
    let value = |x: usize, y: usize| {
        let rgb = map.pixels[y * map.width as usize + x];
        rgb.iter().map(|&of| f64::from(of)).sum::<f64>()
    };
    let mean = |x: usize, y: usize| {
        let [x, y] = [2 * x, 2 * y];
        0.25 * (value(x, y) + value(x + 1, y) + value(x, y + 1) + value(x + 1, y + 1))
    };
    let half: Vec<f64> = (0..width * height)
        .map(|i| mean(i % width, i / width))
        .collect();
    // Weight 3/4 for the coarser texel that contains this one, and 1/4 for its nearest neighbour, on each axis.
    let neighbour = |at: usize, count: usize| match at % 2 {
        0 => (at / 2).saturating_sub(1),
        _ => (at / 2 + 1).min(count - 1),
    };
    let mut difference = 0.0;
    let mut light = 0.0;
    for y in 0..2 * height {
        let rows = [(y / 2, 0.75), (neighbour(y, height), 0.25)];
        for x in 0..2 * width {
            let columns = [(x / 2, 0.75), (neighbour(x, width), 0.25)];
            let mut smooth = 0.0;
            for (row, of_row) in rows {
                for (column, of_column) in columns {
                    smooth += of_row * of_column * half[row * width + column];
                }
            }
            difference += (value(x, y) - smooth).abs();
            light += value(x, y);
        }
    }
    if light > 0.0 { difference / light } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> RgbImage {
        let texels = (0..width * height).map(|i| [value(i % width, i / width); 3]);
        RgbImage {
            width,
            height,
            pixels: texels.collect(),
        }
    }

    #[test]
    fn detail_of_an_edge_falls_as_the_width() {
        assert_eq!(detail(&map(8, 6, |_, _| 2.0)), 0.0);
        assert_eq!(detail(&map(8, 6, |_, _| 0.0)), 0.0);
        assert_eq!(detail(&map(1, 9, |_, _| 1.0)), 0.0);
        let edge = |side: u32| detail(&map(side, side, |x, _| f32::from(u8::from(x >= side / 2))));
        // Two columns on each side of the edge: 1/4 and 1/8 + 0 of the difference.
        let [coarse, fine] = [edge(32), edge(64)];
        assert!((coarse / fine - 2.0).abs() < 1e-6, "{coarse} {fine}");
    }
}
