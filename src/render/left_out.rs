//! What the last caustic left out, why, and how much of the light that is.

use crate::error::Result;
use crate::flux_balance::FluxBalance;
use crate::render::caustic::Caustic;
use crate::render::device_scene::DeviceScene;
use crate::scene::LightKind;
use serde::Serialize;

/// Work or light that a frame left out.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    pub what: String,
    pub why: String,
    /// Share of the light that comes onto the first mirror or interface, where it is known; 0 for work without which the light map is
    /// the same.
    pub share: Option<f64>,
}

impl LeftOut {
    fn new(what: impl Into<String>, why: impl Into<String>, share: Option<f64>) -> Self {
        Self {
            what: what.into(),
            why: why.into(),
            share,
        }
    }
}

/// What the last frame left out; see [`crate::render::Renderer::left_out`].
///
/// # Errors
/// [`crate::Error::Device`] where the device fails.
pub fn left_out(
    device: &DeviceScene,
    caustic: &Caustic,
    balance: Option<&FluxBalance>,
) -> Result<Vec<LeftOut>> {
    let mut all = Vec::new();
    let scene = &device.scene;
    if !device.geometry.can_occlude {
        let why = "nothing in the scene can stand in the way of the light";
        all.push(LeftOut::new(
            "rays from casters to lights and receivers",
            why,
            Some(0.0),
        ));
    }
    if let Some((dark, pairs)) = caustic.dark_facets(device)?
        && dark > 0
    {
        let what = format!("patches of {dark} of {pairs} pairs of facet and light");
        let why =
            "the facet faces away from the light, or the light goes past all rects with light maps";
        all.push(LeftOut::new(what, why, Some(0.0)));
    }
    if let Some(fluxes) = caustic.receiver_fluxes()? {
        for (tile, flux) in device.receivers.tiles.iter().zip(fluxes) {
            if flux == 0.0 {
                let name = scene.objects[tile.object].name.escape_debug();
                let why = "no light of suns and lamps reaches it by a single mirror or interface";
                all.push(LeftOut::new(
                    format!("triangles on \"{name}\""),
                    why,
                    Some(0.0),
                ));
            }
        }
    }
    if scene.specular_objects().next().is_some() && !device.lattices.may_chain {
        let why = "the only caster is flat, a convex mirror, or waves";
        all.push(LeftOut::new(
            "chains of several mirrors and interfaces",
            why,
            Some(0.0),
        ));
    }
    for light in &scene.lights {
        if let LightKind::Environment { .. } = light.kind
            && !light.kind.casts_caustics()
        {
            let what = format!("caustics of \"{}\"", light.name.escape_debug());
            all.push(LeftOut::new(
                what,
                "the scene says `caustics = false`",
                None,
            ));
        }
    }
    if let Some(balance) = balance {
        for (what, flux) in balance.cut_off.entries() {
            let share = balance.share(flux);
            if share > 0.0 {
                all.push(LeftOut::new(what, "chains are cut off there", Some(share)));
            }
        }
    }
    Ok(all)
}
