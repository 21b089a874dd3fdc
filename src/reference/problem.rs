//! What is to be solved: a receiver and the light that may reach it.

use crate::error::{Error, Result};
use crate::reference::lights::Emitter;
use crate::reference::media::Dielectrics;
use crate::reference::mirrors::MirrorTriangle;
use crate::reference::receiver::{MeshReceiver, PlanarReceiver, Receiver};
use crate::reference::visibility::Blockers;
use crate::scene::{Atlas, Geometry, NoLayout, Scene};
use glam::DVec3;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What is to be solved, in the form that both methods use.
pub struct Problem<'a> {
    pub receiver: Receiver,
    pub mirrors: &'a [MirrorTriangle],
    pub emitters: &'a [Emitter],
    /// `None` if nothing blocks light, so nothing is traced.
    pub blockers: Option<&'a Blockers>,
    pub chains: &'a Chains,
    pub cancel: &'a AtomicBool,
}

impl Problem<'_> {
    pub fn blocked(&self, from: DVec3, along: DVec3, length: f64, origin: Option<u32>) -> bool {
        (self.blockers).is_some_and(|blockers| blockers.block(from, along, length, origin))
    }

    pub fn check_cancelled(&self) -> Result<()> {
        check_cancelled(self.cancel)
    }
}

pub fn check_cancelled(cancel: &AtomicBool) -> Result<()> {
    if cancel.load(Ordering::Relaxed) {
        return Err(Error::Cancelled);
    }
    Ok(())
}

/// What chains need to know of a scene.
pub struct Chains {
    pub dielectrics: Dielectrics,
    pub max_interfaces: u32,
    /// For each triangle that blocks light, its number among the specular ones.
    pub mirror_of_blocker: Vec<Option<u32>>,
}

impl Chains {
    pub fn new(scene: &Scene, mirrors: &[MirrorTriangle]) -> Self {
        let last = mirrors.iter().filter_map(|mirror| mirror.blocker).max();
        let mut mirror_of_blocker = vec![None; last.map_or(0, |last| last as usize + 1)];
        for (number, mirror) in (0..).zip(mirrors) {
            if let Some(blocker) = mirror.blocker {
                mirror_of_blocker[blocker as usize] = Some(number);
            }
        }
        Self {
            dielectrics: Dielectrics::of(scene),
            max_interfaces: scene.max_interfaces,
            mirror_of_blocker,
        }
    }
}

pub fn receiver_of(scene: &Scene, receiver: usize, texels: [u32; 2]) -> Result<Receiver> {
    let not_one = || Error::Usage {
        reason: format!("object {receiver} of the scene is not a receiver"),
        remedy: "choose a rect or a mesh with a light map".into(),
    };
    let object = (scene.objects.get(receiver))
        .filter(|object| object.light_map.is_some())
        .ok_or_else(not_one)?;
    match &object.geometry {
        Geometry::Rect(rect) => Ok(Receiver::Planar(PlanarReceiver::new(*rect, texels))),
        geometry @ (Geometry::Mesh(_) | Geometry::Placed { .. }) => {
            let (atlas, _) = Atlas::of(object, texels).map_err(NoLayout::into_error)?;
            let mesh = match geometry {
                Geometry::Mesh(mesh) => mesh.clone(),
                _ => Arc::new(geometry.mesh().into_owned()),
            };
            let receiver = MeshReceiver::new(&mesh, atlas).ok_or_else(not_one)?;
            Ok(Receiver::Mesh(receiver))
        }
        Geometry::Waves(_) => Err(not_one()),
    }
}
