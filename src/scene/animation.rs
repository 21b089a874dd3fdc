//! Scenes over time: keyframes, waves that travel, and meshes that have a frame for every time.

use super::{
    Camera, Geometry, Light, LightKind, Material, Mesh, Object, Scene, Similarity, Texture, Waves,
};
use glam::{DMat3, DVec3};
use std::sync::Arc;

/// What a scene file says of a scene at every time.
#[derive(Debug, Clone)]
pub struct Animation {
    pub(super) camera: Keyframes<Camera>,
    pub(super) lights: Vec<Keyframes<Light>>,
    pub(super) materials: Vec<Material>,
    pub(super) objects: Vec<MovingObject>,
    pub(super) auto_light_maps: Vec<usize>,
    pub(super) max_interfaces: u32,
    pub(super) textures: Vec<Arc<Texture>>,
}

impl Animation {
    /// The scene at `time`, s. Meshes that do not move are shared, not copied.
    pub fn at(&self, time: f64) -> Scene {
        Scene {
            camera: self.camera.at(time, mix_cameras),
            lights: (self.lights.iter())
                .map(|light| light.at(time, mix_lights))
                .collect(),
            materials: self.materials.clone(),
            objects: self.objects.iter().map(|object| object.at(time)).collect(),
            max_interfaces: self.max_interfaces,
            textures: self.textures.clone(),
        }
    }

    /// The objects with `lightmap = "auto"`, whose light maps have a nominal size until [`Self::set_light_map`].
    pub fn auto_light_maps(&self) -> &[usize] {
        &self.auto_light_maps
    }

    /// Sets the size of the light map of an object that has one, texels.
    pub fn set_light_map(&mut self, object: usize, size: [u32; 2]) {
        let light_map = &mut self.objects[object].object.light_map;
        *light_map = light_map.map(|_| size);
    }

    /// Time after which nothing changes, s: 0 for a scene that stands still. `None` where waves travel without an end.
    pub fn end(&self) -> Option<f64> {
        let mut end = self.camera.end();
        for light in &self.lights {
            end = end.max(light.end());
        }
        for moving in &self.objects {
            if let Geometry::Waves(waves) = &moving.object.geometry
                && waves.travel()
            {
                return None;
            }
            if let Some(frames) = &moving.frames {
                end = end.max((frames.meshes.len() - 1) as f64 / frames.fps);
            }
            if let Some(motion) = &moving.motion {
                end = end.max(motion.poses.end());
            }
        }
        Some(end)
    }
}

/// Values at times: mixed between two, the first before all, and the last after all.
#[derive(Debug, Clone)]
pub struct Keyframes<T>(Vec<(f64, T)>);

impl<T: Clone> Keyframes<T> {
    /// At least one value, at times (s) of which each is after the one before.
    pub fn new(values: Vec<(f64, T)>) -> Self {
        assert!(!values.is_empty(), "an empty list is refused by the loader");
        Self(values)
    }

    /// The same at all times.
    pub fn constant(value: T) -> Self {
        Self(vec![(0.0, value)])
    }

    /// Time of the last value, s; 0 where there is one only.
    fn end(&self) -> f64 {
        match self.0.as_slice() {
            [.., (end, _)] if self.0.len() > 1 => end.max(0.0),
            _ => 0.0,
        }
    }

    /// `mix` gets two values and the share of the second.
    fn at(&self, time: f64, mix: impl Fn(&T, &T, f64) -> T) -> T {
        let next = self.0.partition_point(|(start, _)| *start <= time);
        let (start, value) = &self.0[next.saturating_sub(1)];
        match self.0.get(next) {
            Some((end, after)) if time > *start => {
                mix(value, after, (time - start) / (end - start))
            }
            _ => value.clone(),
        }
    }
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + share * (b - a)
}

fn mix_cameras(a: &Camera, b: &Camera, share: f64) -> Camera {
    Camera {
        position: a.position.lerp(b.position, share),
        target: a.target.lerp(b.target, share),
        fov: mix(a.fov, b.fov, share),
        exposure_ev: mix(a.exposure_ev, b.exposure_ev, share),
    }
}

/// Suns go along a great circle.
fn mix_lights(a: &Light, b: &Light, share: f64) -> Light {
    let mut light = a.clone();
    match (&mut light.kind, &b.kind) {
        (
            LightKind::Sun {
                direction,
                irradiance,
                ..
            },
            LightKind::Sun {
                direction: next_direction,
                irradiance: next_irradiance,
                ..
            },
        ) => {
            *direction = direction.slerp(*next_direction, share).normalize();
            *irradiance = irradiance.lerp(*next_irradiance, share);
        }
        (
            LightKind::Lamp {
                position,
                radiant_flux,
                ..
            },
            LightKind::Lamp {
                position: next_position,
                radiant_flux: next_flux,
                ..
            },
        ) => {
            *position = position.lerp(*next_position, share);
            *radiant_flux = radiant_flux.lerp(*next_flux, share);
        }
        (
            LightKind::Environment {
                scale, rotation, ..
            },
            LightKind::Environment {
                scale: next_scale,
                rotation: next_rotation,
                ..
            },
        ) => {
            *scale = mix(*scale, *next_scale, share);
            *rotation = mix(*rotation, *next_rotation, share);
        }
        // Keyframes are of one kind; a kind that is not here has no key that changes.
        _ => {}
    }
    light
}

/// An object and how it moves.
#[derive(Debug, Clone)]
pub struct MovingObject {
    /// At rest.
    pub object: Object,
    /// In place of its geometry.
    pub frames: Option<MeshFrames>,
    pub motion: Option<Motion>,
}

impl MovingObject {
    fn at(&self, time: f64) -> Object {
        let mut object = self.object.clone();
        if let Some(frames) = &self.frames {
            object.geometry = Geometry::Mesh(frames.at(time));
        }
        if let Geometry::Waves(waves) = &mut object.geometry
            && waves.travel()
        {
            waves.time = time;
        }
        if let Some(motion) = &self.motion {
            let pose = motion.pose(time);
            // At rest nothing is rounded, and the mesh is shared.
            if pose != Pose::REST {
                object.geometry = object.geometry.moved(&motion.similarity(&pose));
                if self.frames.is_some() {
                    // A mesh of this time only, which no renderer has at rest.
                    object.geometry = Geometry::Mesh(Arc::new(object.geometry.mesh().into_owned()));
                }
            }
        }
        object
    }
}

impl Waves {
    /// Whether they change with time.
    fn travel(&self) -> bool {
        self.sines.iter().any(|sine| sine.speed != 0.0)
    }
}

/// Meshes of one topology, one after the other, the first at time 0.
#[derive(Debug, Clone)]
pub struct MeshFrames {
    /// Meshes a second.
    pub fps: f64,
    /// At least one; all with the same triangles.
    pub meshes: Vec<Arc<Mesh>>,
}

impl MeshFrames {
    /// Positions and normals between the two meshes before and after `time`.
    fn at(&self, time: f64) -> Arc<Mesh> {
        let last = self.meshes.len() - 1;
        let place = (time * self.fps).clamp(0.0, last as f64);
        let index = place as usize;
        let share = place - index as f64;
        let a = &self.meshes[index];
        if share == 0.0 {
            return a.clone();
        }
        let b = &self.meshes[index + 1];
        let both = |a: &[DVec3], b: &[DVec3]| -> Vec<DVec3> {
            a.iter().zip(b).map(|(a, b)| a.lerp(*b, share)).collect()
        };
        let mut normals = both(&a.normals, &b.normals);
        for (normal, before) in normals.iter_mut().zip(&a.normals) {
            // Half-way between opposite normals there is none.
            *normal = normal.try_normalize().unwrap_or(*before);
        }
        Arc::new(Mesh {
            positions: both(&a.positions, &b.positions),
            normals,
            triangles: a.triangles.clone(),
        })
    }
}

/// Movement of an object as a whole: scaled and turned about `pivot`, then moved.
#[derive(Debug, Clone)]
pub struct Motion {
    /// m
    pub pivot: DVec3,
    /// Unit vector.
    pub axis: DVec3,
    pub poses: Keyframes<Pose>,
}

/// Where an object is, seen from its place at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// m
    pub translation: DVec3,
    /// About the axis, counter-clockwise as seen from its tip, rad.
    pub angle: f64,
    pub scale: f64,
}

impl Pose {
    pub const REST: Self = Self {
        translation: DVec3::ZERO,
        angle: 0.0,
        scale: 1.0,
    };
}

impl Motion {
    fn pose(&self, time: f64) -> Pose {
        self.poses.at(time, |a, b, share| Pose {
            translation: a.translation.lerp(b.translation, share),
            angle: mix(a.angle, b.angle, share),
            scale: mix(a.scale, b.scale, share),
        })
    }

    fn similarity(&self, pose: &Pose) -> Similarity {
        let rotation = DMat3::from_axis_angle(self.axis, pose.angle);
        Similarity {
            scale: pose.scale,
            rotation,
            shift: self.pivot + pose.translation - pose.scale * (rotation * self.pivot),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keyframes_are_held_at_the_ends_and_mixed_between() {
        let keyframes = Keyframes::new(vec![(1.0, 10.0), (2.0, 20.0), (4.0, 0.0)]);
        for (time, value) in [
            (-5.0, 10.0),
            (1.0, 10.0),
            (1.25, 12.5),
            (2.0, 20.0),
            (3.0, 10.0),
            (4.0, 0.0),
            (9.0, 0.0),
        ] {
            assert_eq!(
                keyframes.at(time, |a, b, s| mix(*a, *b, s)),
                value,
                "{time}"
            );
        }
    }

    #[test]
    fn an_animation_ends_with_its_last_keyframe() {
        assert_eq!(Keyframes::constant(1.0).end(), 0.0);
        assert_eq!(Keyframes::new(vec![(5.0, 1.0)]).end(), 0.0);
        assert_eq!(Keyframes::new(vec![(-2.0, 1.0), (5.0, 2.0)]).end(), 5.0);
    }

    /// Scaled and turned about the pivot first, then moved.
    #[test]
    fn a_pose_is_taken_about_the_pivot() {
        let motion = Motion {
            pivot: DVec3::new(1.0, 0.0, 0.0),
            axis: DVec3::Y,
            poses: Keyframes::constant(Pose {
                translation: DVec3::new(0.0, 5.0, 0.0),
                angle: std::f64::consts::FRAC_PI_2,
                scale: 2.0,
            }),
        };
        let moved = motion
            .similarity(&motion.pose(3.0))
            .place(DVec3::new(2.0, 1.0, 0.0));
        assert!(
            moved.distance(DVec3::new(1.0, 7.0, -2.0)) < 1e-12,
            "{moved}"
        );
    }
}
