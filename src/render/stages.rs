//! The stages of a method, bound to a scene.

use crate::error::{Error, Result};
use crate::gpu::{Context, Image};
use crate::render::device_scene::DeviceScene;
use crate::render::frame::Caustic;
use crate::render::lights::Source;
use crate::render::methods::pinhole::Pinhole;
use crate::render::methods::points::Points;
use crate::render::patches::sample::Sample;
use crate::render::settings::{Method, Settings};
use crate::render::splat::footprints::footprints;
use crate::render::splat::mesh_footprints::mesh_footprints;
use crate::render::splat::pinhole_images::pinhole_images;
use crate::render::splat::resolve::{Levels, Resolve};
use crate::render::splat::triangles::triangles;
use std::sync::Arc;

/// # Errors
/// [`Error::Usage`] where the method cannot light a receiver, [`Error::Device`] where the device fails.
pub fn caustic(
    context: &Arc<Context>,
    scene: &DeviceScene,
    light_map: &Image,
    settings: &Settings,
) -> Result<Caustic> {
    if settings.method == Method::Points {
        let points = Points::new(context, scene, settings.samples)?;
        return Ok(Caustic::Points(points));
    }
    let sample = Sample::new(context, scene)?;
    match settings.method {
        Method::Footprint => by_footprints(context, scene, light_map, sample),
        Method::Beams => {
            if let Some(tile) = scene.receivers.mesh_tiles().first() {
                return Err(Error::Usage {
                    reason: format!(
                        "the method beams lights rects only, and object `{}` is a mesh with a light map",
                        scene.scene.objects[tile.object].name
                    ),
                    remedy: "choose another method, or remove the object's `lightmap`".into(),
                });
            }
            let projector = triangles(context, scene, &sample.patches)?;
            Ok(Caustic::Splat {
                sample,
                projectors: vec![projector],
                resolve: None,
            })
        }
        _ => {
            let pinhole = Pinhole::new(context, scene, &sample.patches, light_map, settings)?;
            Ok(Caustic::Gather { sample, pinhole })
        }
    }
}

/// Triangles for narrow lights and footprints for wide ones; wide footprints go to coarser levels. For an environment,
/// pinhole images where patch clusters act as pinholes, and footprints elsewhere.
fn by_footprints(
    context: &Arc<Context>,
    scene: &DeviceScene,
    light_map: &Image,
    sample: Sample,
) -> Result<Caustic> {
    let patches = &sample.patches;
    let mut projectors = Vec::new();
    let mut resolve = None;
    let has = |source| scene.groups(source).next().is_some();
    if scene.receivers.planar_count > 0 {
        if has(Source::Narrow) {
            projectors.push(triangles(context, scene, patches)?);
        }
        if has(Source::Wide) || has(Source::Environment) {
            let levels = Levels::new(context, scene)?;
            if has(Source::Environment) {
                projectors.push(pinhole_images(context, scene, patches, &levels)?);
            }
            for source in [Source::Wide, Source::Environment]
                .into_iter()
                .filter(|s| has(*s))
            {
                projectors.push(footprints(context, scene, source, patches, &levels)?);
            }
            resolve = Some(Resolve::new(context, scene, levels, light_map)?);
        }
    }
    if scene.receivers.mesh_count() > 0 {
        for source in [Source::All, Source::Environment]
            .into_iter()
            .filter(|s| has(*s))
        {
            projectors.push(mesh_footprints(context, scene, source, patches)?);
        }
    }
    Ok(Caustic::Splat {
        sample,
        projectors,
        resolve,
    })
}
