//! The sweeps, as data.

use super::glass;
use super::scenes::{self, RECEIVER};
use crate::scene::Scene;
use glam::DVec3;

/// A family of scenes over one parameter.
#[derive(Clone)]
pub struct Sweep {
    pub name: &'static str,
    pub title: &'static str,
    /// The scene and how it is measured.
    pub setup: &'static str,
    /// What is swept, with its unit.
    pub axis: &'static str,
    /// Positive, in the order of the story.
    pub values: Vec<f64>,
    pub swept: Swept,
    /// Of a value and a frame.
    pub scene: fn(f64, u32) -> Scene,
    /// Frames of the sequence, 1 for a still.
    pub frames: u32,
    /// Texels on a side of the light map.
    pub texels: u32,
    pub truth: Truth,
    /// Relative error that references should have.
    pub error: f64,
    /// Where nothing should change: the value whose map all others should equal.
    pub base: Option<f64>,
}

/// What the value is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Swept {
    /// A parameter of the scene only.
    Scene,
    /// Texels on a side of the light map.
    LightMap,
    /// Samples over a method's usual ones.
    Samples,
}

/// Where the truth comes from.
#[derive(Clone, Copy)]
pub enum Truth {
    /// The reference for the scene itself.
    Reference,
    /// The closed form of the dish at this height of the screen where that applies, elsewhere the
    /// reference.
    Dish,
    /// The reference at one value, for all.
    At(f64),
    /// The reference for another scene.
    Other(fn(f64, u32) -> Scene),
}

/// Truths are at most this fine; finer maps are averaged before they are compared.
const FINEST_TRUTH: u32 = 256;

impl Sweep {
    /// Texels on a side of the methods' maps.
    pub fn texels_at(&self, value: f64) -> u32 {
        match self.swept {
            Swept::LightMap => value as u32,
            _ => self.texels,
        }
    }

    pub fn truth_texels_at(&self, value: f64) -> u32 {
        self.texels_at(value).min(FINEST_TRUTH)
    }

    /// Samples over a method's usual ones.
    pub fn effort_at(&self, value: f64) -> f64 {
        match self.swept {
            Swept::Samples => value,
            _ => 1.0,
        }
    }

    /// The scene with its light map.
    pub fn scene_at(&self, value: f64, frame: u32) -> Scene {
        let mut scene = (self.scene)(value, frame);
        let receiver = self.receiver(&scene);
        scene.objects[receiver].light_map = Some([self.texels_at(value); 2]);
        scene
    }

    /// Index of the object that receives the light.
    pub fn receiver(&self, scene: &Scene) -> usize {
        (scene.object_index(RECEIVER)).expect("all scenes have a receiver")
    }

    /// The two ends and the middle, on coarse maps, with a rough truth.
    pub fn quick(mut self) -> Self {
        let last = self.values.len() - 1;
        let mut indices = vec![0, last / 2, last];
        indices.dedup();
        self.values = indices.into_iter().map(|i| self.values[i]).collect();
        self.texels = 64;
        self.error = 0.03;
        self.frames = self.frames.min(3);
        self
    }

    /// How often [`super::run`] calls its `step` for this many contenders.
    pub fn steps(&self, contenders: usize) -> u64 {
        (self.values.len() * (1 + contenders)) as u64
    }
}

const TURN: f64 = 0.05;

/// All sweeps.
pub fn sweeps() -> Vec<Sweep> {
    let usual = Sweep {
        name: "",
        title: "",
        setup: "",
        axis: "",
        values: Vec::new(),
        swept: Swept::Scene,
        scene: |_, _| scenes::ring(),
        frames: 1,
        texels: 128,
        truth: Truth::Reference,
        error: 0.01,
        base: None,
    };
    vec![
        Sweep {
            name: "focus",
            title: "The focus moves through the receiver",
            setup: "A paraboloid under a point of light on its axis, and a screen across the axis. \
                    Truth: the closed form, within a tenth of f around the focus the reference.",
            axis: "height of the screen z / f",
            values: vec![
                0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 1.0, 1.01, 1.02, 1.05, 1.1, 1.2, 1.35, 1.5,
            ],
            scene: |z, _| scenes::dish(z * scenes::FOCAL_LENGTH),
            truth: Truth::Dish,
            ..usual.clone()
        },
        Sweep {
            name: "contact-face",
            title: "A caster approaches contact, face to face",
            setup: "A wavy mirror of 1 m × 1 m below a screen that is parallel to it, light from above.",
            axis: "gap over the crests / size of the mirror",
            values: vec![1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3],
            scene: |gap, _| scenes::face(gap),
            ..usual.clone()
        },
        Sweep {
            name: "contact-edge",
            title: "A caster approaches contact with its edge",
            setup: "A ring mirror of radius 1 m and height 0.4 m that comes down to a floor, sun from 35°.",
            axis: "gap / height of the ring",
            values: vec![1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3],
            scene: |gap, _| scenes::edge(gap),
            ..usual.clone()
        },
        Sweep {
            name: "curvature",
            title: "From a flat mirror to a tiny sphere",
            setup: "A convex cap of a sphere, 1 m across or half the sphere, 1 m below a screen.",
            axis: "curvature, 1/m",
            values: vec![1e-6, 1e-4, 0.01, 0.1, 0.5, 1.0, 2.0, 10.0, 100.0, 1000.0],
            scene: |curvature, _| scenes::curved(curvature),
            ..usual.clone()
        },
        Sweep {
            name: "sun",
            title: "From a wide sun to a point",
            setup: "A ring mirror on a floor, sun from 35°.",
            axis: "angular radius of the sun, °",
            values: vec![5.0, 2.5, 1.0, 0.5, 0.25, 0.1, 0.03, 0.01],
            scene: |radius, _| scenes::ring_under(radius),
            ..usual.clone()
        },
        Sweep {
            name: "grazing",
            title: "Grazing incidence",
            setup: "A slightly convex mirror, and a screen across the reflected light, 1 m away.",
            axis: "90° − angle of incidence, °",
            values: vec![90.0, 60.0, 30.0, 15.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.1],
            scene: |elevation, _| scenes::grazing(elevation),
            ..usual.clone()
        },
        Sweep {
            name: "mesh-smooth",
            title: "Segments of a mesh with smooth normals",
            setup: "A ring mirror on a floor, two triangles a segment. Truth is the reference for the same \
                    mesh, so the curve shows the method's error, not the mesh's.",
            axis: "segments",
            values: vec![8.0, 16.0, 32.0, 64.0, 256.0, 1024.0, 4096.0],
            scene: |segments, _| scenes::mesh(segments, true),
            ..usual.clone()
        },
        Sweep {
            name: "mesh-facetted",
            title: "Segments of a mesh with facetted normals",
            setup: "As before, every segment a flat mirror.",
            axis: "segments",
            values: vec![8.0, 16.0, 32.0, 64.0, 256.0, 1024.0, 4096.0],
            scene: |segments, _| scenes::mesh(segments, false),
            ..usual.clone()
        },
        Sweep {
            name: "bumps",
            title: "Bumps finer than the sampling",
            setup: "A mirror of 1 m × 1 m with sine waves of constant slope (0.1) on a mesh of 48 × 48 \
                    quads, 1 m below a screen. Truth is the reference for the same mesh.",
            axis: "waves along a side",
            values: vec![1.0, 2.0, 4.0, 6.0, 9.0, 12.0, 16.0, 20.0, 23.0],
            scene: |waves, _| scenes::bumps(waves),
            ..usual.clone()
        },
        Sweep {
            name: "light-map",
            title: "The size of the light map",
            setup: "A ring mirror on a floor. Maps of more than 256 texels a side are averaged to 256 before \
                    they are compared.",
            axis: "texels on a side",
            values: vec![32.0, 64.0, 128.0, 256.0, 512.0, 1024.0, 2048.0],
            swept: Swept::LightMap,
            ..usual.clone()
        },
        Sweep {
            name: "scale",
            title: "The scene in other sizes",
            setup: "A ring mirror on a floor, with shadows. Nothing in it has a length of its own, so all maps \
                    should be equal. Drift: against the map at scale 1.",
            axis: "scale",
            values: vec![1e-3, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0],
            scene: |scale, _| scenes::transformed(scale, DVec3::ZERO),
            texels: 64,
            truth: Truth::At(1.0),
            base: Some(1.0),
            ..usual.clone()
        },
        Sweep {
            name: "shift",
            title: "The scene in other places",
            setup: "The same, moved. Drift: against the map at the origin.",
            axis: "distance along each axis, m",
            values: vec![1.0, 10.0, 100.0, 1000.0, 1e4],
            scene: |shift, _| scenes::transformed(1.0, shift * DVec3::new(1.0, -1.0, 0.7)),
            texels: 64,
            truth: Truth::At(0.0),
            base: Some(0.0),
            ..usual.clone()
        },
        Sweep {
            name: "turning",
            title: "A caster that turns by 0.05° a frame",
            setup: "A wavy mirror, 1 m below a screen, in 6 frames.",
            axis: "samples / usual samples",
            values: vec![0.125, 0.5, 2.0, 8.0],
            swept: Swept::Samples,
            scene: |_, frame| scenes::turned(TURN * f64::from(frame)),
            frames: 6,
            truth: Truth::At(1.0),
            error: 0.003,
            ..usual.clone()
        },
        Sweep {
            name: "suns",
            title: "From one sun to many",
            setup: "A ring mirror on a floor, under suns within 20° of one direction.",
            axis: "suns",
            values: vec![1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0],
            scene: |count, _| scenes::suns(count),
            ..usual.clone()
        },
        Sweep {
            name: "glass-interfaces",
            title: "From one interface to sixteen",
            setup: "A glass ball of radius 0.5 m, 0.1 m over a floor, sun from 45°. Light that met more interfaces is left out.",
            axis: "interfaces that light meets at most",
            values: vec![1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0],
            scene: |interfaces, _| glass::ball_of(interfaces),
            ..usual.clone()
        },
        Sweep {
            name: "glass-contact",
            title: "A glass ball approaches contact",
            setup: "A glass ball of radius 0.5 m that comes down to a floor, sun from 45°.",
            axis: "gap / radius",
            values: vec![1.0, 0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3],
            scene: |gap, _| glass::ball(gap),
            ..usual.clone()
        },
        Sweep {
            name: "glass-index",
            title: "Glass that becomes air",
            setup: "A ball of radius 0.5 m, 0.1 m over a floor, sun from 45°. At the end its light is its shadow, filled.",
            axis: "index of refraction − 1",
            values: vec![0.5, 0.2, 0.1, 0.03, 0.01, 3e-3, 1e-3],
            scene: |excess, _| glass::faint_ball(excess),
            ..usual.clone()
        },
        Sweep {
            name: "glass-wall",
            title: "The wall of a tube becomes thin",
            setup: "An upright tube of glass, 0.8 m wide and 0.6 m high, 10 mm over a floor, sun from 45°.",
            axis: "thickness of the wall / outer radius",
            values: vec![0.5, 0.2, 0.1, 0.03, 0.01, 3e-3, 1e-3],
            scene: |wall, _| glass::tube(wall),
            ..usual.clone()
        },
        Sweep {
            name: "glass-total-reflection",
            title: "Near total reflection",
            setup: "A prism with three equal sides of 0.3 m and an index of 1.5, sun from 15°. Light of the middle of the sun that meets \
                    the first face at less than 27.92° is reflected totally at the second one.",
            axis: "angle of incidence on the first face, °",
            values: vec![45.0, 35.0, 30.0, 29.0, 28.2, 28.0, 27.92, 27.8, 27.5, 25.0],
            scene: |incidence, _| glass::prism(incidence),
            ..usual.clone()
        },
        Sweep {
            name: "glass-dispersion",
            title: "Glass that disperses more and more",
            setup: "The same prism with the index 1.736 at 550 nm; light meets its first face at 55° to the normal.",
            axis: "dispersion over that of SF10",
            values: vec![1e-3, 0.01, 0.03, 0.1, 0.3, 1.0],
            scene: |factor, _| glass::dispersing_prism(factor),
            ..usual
        },
    ]
}
