//! The balance of the flux of chains: how much light comes in, and where it ends. All fluxes are in W, in red, green and blue.
//!
//! The light that comes in is what suns, lamps and environment cells send onto the first mirror or interface on its way. Every
//! other entry of [`FluxBalance`] is a part of it, so that they add up to what came in. Light is counted where the centre of a
//! ray ends; the light maps blur it over its surroundings.

use serde::Serialize;

/// RGB, W.
pub type Flux = [f64; 3];

/// Where the light that came in ended.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct FluxBalance {
    /// Onto the first mirrors and interfaces, W.
    pub incoming: Flux,
    /// On the fronts of receivers, by the number of mirrors and interfaces on the way, from 1 on, W.
    pub landed: Vec<Flux>,
    /// On diffuse surfaces without a light map, and on the backs of mirrors and receivers, W.
    pub on_other_surfaces: Flux,
    /// Absorbed by coloured media, W.
    pub absorbed_by_media: Flux,
    /// Absorbed by mirrors and metals, W.
    pub absorbed_by_mirrors: Flux,
    /// Into directions in which there is nothing more, W.
    pub left_scene: Flux,
    pub cut_off: CutOff,
    /// Weak lobes are followed by a regular part of the rays in place of all: the flux of the rays that do not follow theirs, less
    /// what the others carry for them, W. It has either sign and becomes smaller with more rays.
    pub sampling: Flux,
}

/// Light that the renderer does not follow to its end.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct CutOff {
    /// Lobes with less than 0.3 % of the flux of their ray, W.
    pub faint: Flux,
    /// Weak lobes after two others on the same chain, W.
    pub weak: Flux,
    /// Light that would meet one more mirror or interface than [`crate::scene::Scene::max_interfaces`], and light beside the edge
    /// of a receiver where the last pass ends, W.
    pub interfaces: Flux,
    /// Light for which the buffers have no room, W.
    pub room: Flux,
    /// Light that interpolated normals would send into the surface that it comes from, W.
    pub normals: Flux,
}

impl CutOff {
    /// What is cut off, in words for a report, with its flux, W.
    pub fn entries(&self) -> [(&'static str, Flux); 5] {
        [
            ("faint lobes", self.faint),
            ("weak lobes", self.weak),
            ("further interfaces", self.interfaces),
            ("no room in the buffers", self.room),
            ("interpolated normals", self.normals),
        ]
    }

    /// Sum of the entries, W.
    pub fn total(&self) -> Flux {
        sum(self.entries().map(|(_, flux)| flux))
    }
}

impl FluxBalance {
    /// Flux that landed on receivers, W.
    pub fn total_landed(&self) -> Flux {
        sum(self.landed.iter().copied())
    }

    /// Sum of all entries but `incoming`, W. It differs from `incoming` by rounding only.
    pub fn outgoing(&self) -> Flux {
        sum([
            self.total_landed(),
            self.on_other_surfaces,
            self.absorbed_by_media,
            self.absorbed_by_mirrors,
            self.left_scene,
            self.cut_off.total(),
            self.sampling,
        ])
    }

    /// A flux, summed over the channels, over the incoming flux; 0 where no light comes in.
    pub fn share(&self, flux: Flux) -> f64 {
        let incoming: f64 = self.incoming.iter().sum();
        match incoming > 0.0 {
            true => flux.iter().sum::<f64>() / incoming,
            false => 0.0,
        }
    }
}

fn sum(fluxes: impl IntoIterator<Item = Flux>) -> Flux {
    let add = |a: Flux, b: Flux| [0, 1, 2].map(|channel| a[channel] + b[channel]);
    fluxes.into_iter().fold([0.0; 3], add)
}
