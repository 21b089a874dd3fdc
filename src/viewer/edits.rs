//! The user's edits of a scene, kept apart from the scene, with undo and redo.

use glam::{DMat3, DQuat, DVec3};
use nephroid::glam;
use nephroid::scene::{Camera, EXPOSURES_EV, LightKind, MaterialKind, Scene, Similarity};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where an object is, seen from its place in the scene file: turned about its pivot, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// m
    pub shift: DVec3,
    pub rotation: DQuat,
}

impl Placement {
    pub const REST: Self = Self {
        shift: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
    };

    fn similarity(&self, pivot: DVec3) -> Similarity {
        let rotation = DMat3::from_quat(self.rotation);
        Similarity {
            scale: 1.0,
            rotation,
            shift: pivot + self.shift - rotation * pivot,
        }
    }
}

/// Values in place of those of the scene, by the indices of the scene.
#[derive(Debug, Clone, Default)]
pub struct Edits {
    pub exposure_ev: Option<f64>,
    /// Replaces the scene's camera and its keyframes, if any.
    pub camera: Option<Camera>,
    pub lights: BTreeMap<usize, LightKind>,
    pub materials: BTreeMap<usize, MaterialKind>,
    pub objects: BTreeMap<usize, Placement>,
    /// Texels.
    pub light_maps: BTreeMap<usize, [u32; 2]>,
}

impl PartialEq for Edits {
    fn eq(&self, other: &Self) -> bool {
        let same_camera = match (&self.camera, &other.camera) {
            (Some(a), Some(b)) => same_view(a, b),
            (a, b) => a.is_none() && b.is_none(),
        };
        same_camera
            && self.exposure_ev == other.exposure_ev
            && self.lights.keys().eq(other.lights.keys())
            && (self.lights.values().zip(other.lights.values())).all(|(a, b)| same_light(a, b))
            && self.materials == other.materials
            && self.objects == other.objects
            && self.light_maps == other.light_maps
    }
}

/// Whether two lights are equal. The pixels of their environments are not compared: all are of one scene.
pub fn same_light(a: &LightKind, b: &LightKind) -> bool {
    match (a, b) {
        (
            LightKind::Environment {
                map: m0,
                scale: s0,
                rotation: r0,
                casts_caustics: c0,
            },
            LightKind::Environment {
                map: m1,
                scale: s1,
                rotation: r1,
                casts_caustics: c1,
            },
        ) => Arc::ptr_eq(m0, m1) && (s0, r0, c0) == (s1, r1, c1),
        (a, b) => a == b,
    }
}

/// `camera` with the exposure of `other`.
pub fn with_exposure_of(camera: &Camera, other: &Camera) -> Camera {
    Camera {
        exposure_ev: other.exposure_ev,
        ..camera.clone()
    }
}

/// Whether two cameras see the same.
pub fn same_view(a: &Camera, b: &Camera) -> bool {
    (a.position, a.target, a.fov) == (b.position, b.target, b.fov)
}

impl Edits {
    /// Sets the exposure to the nearest one that a scene file may have.
    pub fn set_exposure(&mut self, exposure_ev: f64) {
        self.exposure_ev = Some(exposure_ev.clamp(*EXPOSURES_EV.start(), *EXPOSURES_EV.end()));
    }

    /// The scene with these values. Objects are turned about `pivots`.
    pub fn apply(&self, scene: &mut Scene, pivots: &[DVec3]) {
        if let Some(camera) = &self.camera {
            scene.camera = with_exposure_of(camera, &scene.camera);
        }
        if let Some(exposure_ev) = self.exposure_ev {
            scene.camera.exposure_ev = exposure_ev;
        }
        for (index, kind) in &self.lights {
            scene.lights[*index].kind = kind.clone();
        }
        for (index, kind) in &self.materials {
            scene.materials[*index].kind = kind.clone();
        }
        for (index, placement) in &self.objects {
            let geometry = &mut scene.objects[*index].geometry;
            *geometry = geometry.moved(&placement.similarity(pivots[*index]));
        }
        for (index, texels) in &self.light_maps {
            scene.objects[*index].light_map = Some(*texels);
        }
    }

    /// The edits that still apply in a scene that was read again, whose `names` may differ from the old ones.
    pub fn carried_over(&self, old: &Scene, new: &Scene) -> Self {
        let kind_of = std::mem::discriminant::<LightKind>;
        let light = |i: &usize| {
            let before = &old.lights[*i];
            let index = new
                .lights
                .iter()
                .position(|light| light.name == before.name)?;
            (kind_of(&before.kind) == kind_of(&new.lights[index].kind)).then_some(index)
        };
        let kind_of = std::mem::discriminant::<MaterialKind>;
        let material = |i: &usize| {
            let before = &old.materials[*i];
            let index = (new.materials.iter()).position(|material| material.name == before.name)?;
            (kind_of(&before.kind) == kind_of(&new.materials[index].kind)).then_some(index)
        };
        let object = |i: &usize| new.object_index(&old.objects[*i].name);
        Self {
            exposure_ev: self.exposure_ev,
            camera: self.camera.clone(),
            lights: carried(&self.lights, light)
                .into_iter()
                .map(|(index, kind)| (index, with_map_of(kind, &new.lights[index].kind)))
                .collect(),
            materials: carried(&self.materials, material),
            objects: carried(&self.objects, object),
            light_maps: carried(&self.light_maps, |i| {
                object(i).filter(|index| new.objects[*index].light_map.is_some())
            }),
        }
    }
}

/// The light with the environment's image of `new`.
fn with_map_of(mut kind: LightKind, new: &LightKind) -> LightKind {
    if let (LightKind::Environment { map, .. }, LightKind::Environment { map: read, .. }) =
        (&mut kind, new)
    {
        *map = read.clone();
    }
    kind
}

fn carried<T: Clone>(
    values: &BTreeMap<usize, T>,
    index: impl Fn(&usize) -> Option<usize>,
) -> BTreeMap<usize, T> {
    values
        .iter()
        .filter_map(|(old, value)| Some((index(old)?, value.clone())))
        .collect()
}

/// The points about which objects turn: the middle of their bounds, m.
pub fn pivots(scene: &Scene) -> Vec<DVec3> {
    (scene.objects.iter())
        .map(|object| object.geometry.middle())
        .collect()
}

/// Current edits, with the steps to undo and redo.
#[derive(Debug, Clone, Default)]
pub struct History {
    pub now: Edits,
    /// The edits at the end of the last step.
    settled: Edits,
    undone: Vec<Edits>,
    done: Vec<Edits>,
}

impl History {
    /// Ends a step where anything changed: a drag is one step, not one for every frame.
    pub fn settle(&mut self) {
        if self.now != self.settled {
            self.done
                .push(std::mem::replace(&mut self.settled, self.now.clone()));
            self.undone.clear();
        }
    }

    pub fn undo(&mut self) {
        self.settle();
        if let Some(before) = self.done.pop() {
            self.undone
                .push(std::mem::replace(&mut self.now, before.clone()));
            self.settled = before;
        }
    }

    pub fn redo(&mut self) {
        self.settle();
        if let Some(after) = self.undone.pop() {
            self.done
                .push(std::mem::replace(&mut self.now, after.clone()));
            self.settled = after;
        }
    }

    pub fn can_undo(&self) -> bool {
        !self.done.is_empty() || self.now != self.settled
    }

    pub fn can_redo(&self) -> bool {
        !self.undone.is_empty()
    }

    /// Whether there is anything to be saved.
    pub fn is_edited(&self) -> bool {
        self.now != Edits::default()
    }

    /// For a scene that was read again; steps before it are of another scene.
    pub fn carry_over(&mut self, old: &Scene, new: &Scene) {
        let now = self.now.carried_over(old, new);
        *self = Self {
            now: now.clone(),
            settled: now,
            ..Self::default()
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exposed(history: &mut History, exposure_ev: f64) {
        history.now.exposure_ev = Some(exposure_ev);
    }

    #[test]
    fn a_drag_is_one_step() {
        let mut history = History::default();
        for exposure in [1.0, 2.0, 3.0] {
            exposed(&mut history, exposure);
        }
        history.settle();
        exposed(&mut history, 7.0);
        history.undo();
        assert_eq!(history.now.exposure_ev, Some(3.0));
        history.undo();
        assert_eq!(history.now.exposure_ev, None);
        history.undo();
        assert!(!history.can_undo());
        history.redo();
        history.redo();
        history.redo();
        assert_eq!(history.now.exposure_ev, Some(7.0));
        history.now.set_exposure(1e308);
        assert_eq!(history.now.exposure_ev, Some(64.0));
        history.undo();
        exposed(&mut history, 9.0);
        history.settle();
        assert!(!history.can_redo());
    }

    #[test]
    fn objects_turn_about_their_pivot() {
        let placement = Placement {
            shift: DVec3::new(0.0, 5.0, 0.0),
            rotation: DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2),
        };
        let pivot = DVec3::new(1.0, 0.0, 0.0);
        let by = placement.similarity(pivot);
        let at = by.rotation * pivot + by.shift;
        assert!(at.distance(DVec3::new(1.0, 5.0, 0.0)) < 1e-12, "{at}");
    }
}
