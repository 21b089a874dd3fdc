//! Glass that disperses light: a closed form, and the reference.

use crate::common::glass::{self, block};
use crate::common::{
    Device, assert_error_beyond_noise, footprint, l1, l1_noise, load_with_chains, method,
    object_mut, only_receiver, options, solve, texels, with_texels,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::optics::fresnel_dielectric;
use nephroid::render::{Method, Settings};
use nephroid::scene::{
    Dielectric, Dispersion, GLASSES, Geometry, LightKind, MaterialKind, Rect, Scene,
};
use nephroid::spectrum;
use std::f64::consts::FRAC_PI_3;

/// By which the prism of the scene is turned from its mesh.
const TURNED: f64 = 29.8;
/// From the prism to the screen, m: far, so that the width of the beam does not matter.
const DISTANCE: f64 = 20.0;
const WIDTH: f64 = 1.6;
const TEXELS: [u32; 2] = [256, 16];

/// Deviation of light that meets an equilateral prism at the angle `incidence` to the normal: i + e − A with the angle of
/// emergence sin e = sin A √(n² − sin² i) − cos A sin i (Born and Wolf, *Principles of optics*, section 4.7.2).
fn deviation(incidence: f64, index: f64) -> f64 {
    let (sine, cosine) = FRAC_PI_3.sin_cos();
    let emergence =
        sine * (index.powi(2) - incidence.sin().powi(2)).sqrt() - cosine * incidence.sin();
    incidence + emergence.asin() - FRAC_PI_3
}

/// The prism of `prism.toml`, of BK7, in light along +x, and a screen that faces it where light of 550 nm goes. Also returns the angle
/// of incidence.
fn prism() -> (Scene, f64) {
    let mut scene = load_with_chains("prism.toml");
    let glass = Dispersion::Sellmeier(GLASSES[0].1);
    let index = scene.object_index("prism").unwrap();
    let material = scene.objects[index].material;
    scene.materials[material].kind = MaterialKind::Dielectric(Dielectric {
        dispersion: Some(glass),
        ..Dielectric::new(1.5168)
    });
    scene
        .objects
        .retain(|object| ["prism", "wall"].contains(&&*object.name));
    scene.lights.truncate(1);
    scene.lights[0].kind = LightKind::Sun {
        direction: DVec3::NEG_X,
        irradiance: DVec3::ONE,
        angular_radius: 1e-3,
    };
    // The normal of the face that is lit lies 30° from -x, before the prism is turned, toward +z.
    let incidence = (30.0 + TURNED).to_radians();
    let bent = deviation(incidence, glass.index(spectrum::MIDDLE));
    let ahead = DVec3::new(bent.cos(), 0.0, -bent.sin());
    let further_bent = DVec3::new(-bent.sin(), 0.0, -bent.cos());
    let wall = object_mut(&mut scene, "wall");
    wall.light_map = Some(TEXELS);
    wall.geometry = Geometry::Rect(Rect {
        origin: DISTANCE * ahead - 0.5 * WIDTH * further_bent + 0.4 * DVec3::Y,
        edge_u: WIDTH * further_bent,
        edge_v: 0.6 * DVec3::NEG_Y,
    });
    (scene, incidence)
}

/// Mean place of the light of each channel along the screen, m from its middle, and the sum of each.
fn places(map: &RgbImage) -> [DVec3; 2] {
    let [mut place, mut sum] = [DVec3::ZERO; 2];
    for (texel, value) in map.pixels.iter().enumerate() {
        let value = DVec3::from(value.map(f64::from));
        let column = (texel % TEXELS[0] as usize) as f64 + 0.5;
        place += value * WIDTH * (column / f64::from(TEXELS[0]) - 0.5);
        sum += value;
    }
    [place / sum, sum]
}

/// Mean over the wavelengths of each colour channel.
fn mean_of_colours(value: impl Fn(f64) -> f64) -> DVec3 {
    const STEPS: u32 = 2000;
    let drawn = (0..STEPS).map(|i| spectrum::draw((f64::from(i) + 0.5) / f64::from(STEPS)));
    drawn
        .map(|(wavelength, weight)| weight * value(wavelength))
        .sum::<DVec3>()
        / f64::from(STEPS)
}

/// Transmittance of both faces of the prism, by Fresnel's equations.
fn transmittance(incidence: f64, index: f64) -> f64 {
    let inside = (incidence.sin() / index).asin();
    let reflected = [
        fresnel_dielectric(incidence.cos(), 1.0 / index),
        fresnel_dielectric((FRAC_PI_3 - inside).cos(), index),
    ];
    reflected.map(|share| 1.0 - share).iter().product()
}

/// Two colours are the same but for their brightness.
#[track_caller]
fn assert_colour(found: DVec3, expected: DVec3, bound: f64) {
    let [found, expected] = [found, expected].map(|colour| colour / colour.y);
    println!("colour {found}, expected {expected}");
    assert!((found - expected).abs().max_element() < bound);
}

/// Light that a face reflects, at 60°, has the mean reflectance of the wavelengths of each colour channel.
#[test]
fn a_face_reflects_each_channel_by_fresnels_equations() {
    let incidence = FRAC_PI_3;
    let dispersion = Dispersion::Sellmeier(GLASSES[1].1);
    let flint = MaterialKind::Dielectric(Dielectric {
        dispersion: Some(dispersion),
        ..Dielectric::new(dispersion.index(spectrum::MIDDLE))
    });
    let plate = block(DVec3::new(-0.2, -0.1, -0.2), DVec3::new(0.2, 0.0, 0.2));
    let wall = Rect {
        origin: DVec3::new(-1.0, 0.0, -0.5),
        edge_u: DVec3::Y,
        edge_v: DVec3::Z,
    };
    let toward = DVec3::new(incidence.sin(), incidence.cos(), 0.0);
    let scene = Scene {
        max_interfaces: 1,
        ..glass::scene(toward, wall, vec![(flint, plate)])
    };
    let expected = mean_of_colours(|wavelength| {
        fresnel_dielectric(incidence.cos(), 1.0 / dispersion.index(wavelength))
    });
    let device = Device::open();
    for method_ in [Method::Footprint, Method::Beams, Method::Points] {
        let map = device.caustic(&scene, "floor", &method(method_, 65_536));
        let sum = map.pixels.iter().map(|rgb| DVec3::from(rgb.map(f64::from)));
        assert_colour(sum.sum(), expected, 0.002);
    }
}

/// A flat surface of glass over a floor that is in the glass, in light at 60°: every colour is where Snell's law says, and as
/// bright as Fresnel's equations say, on a rect and on a mesh.
#[test]
fn a_single_surface_disperses_light() {
    const DEPTH: f64 = 2.0;
    let incidence = FRAC_PI_3;
    let dispersion = Dispersion::Sellmeier(GLASSES[1].1);
    let flint = MaterialKind::Dielectric(Dielectric {
        dispersion: Some(dispersion),
        ..Dielectric::new(dispersion.index(spectrum::MIDDLE))
    });
    let surface = Geometry::Rect(Rect {
        origin: DVec3::new(-0.1, 0.0, 0.1),
        edge_u: 0.2 * DVec3::X,
        edge_v: 0.2 * DVec3::NEG_Z,
    });
    let floor = Rect {
        origin: DVec3::new(-1.5, -DEPTH, 0.3),
        edge_u: DVec3::X,
        edge_v: 0.6 * DVec3::NEG_Z,
    };
    let toward = DVec3::new(incidence.sin(), incidence.cos(), 0.0);
    let scene = Scene {
        max_interfaces: 1,
        ..glass::scene(toward, floor, vec![(flint, surface)])
    };
    let scene = with_texels(scene, "floor", TEXELS);
    let index = |wavelength| dispersion.index(wavelength);
    let passes = |wavelength| 1.0 - fresnel_dielectric(incidence.cos(), 1.0 / index(wavelength));
    let place = |wavelength: f64| -DEPTH * (incidence.sin() / index(wavelength)).asin().tan();
    let passing = mean_of_colours(passes);
    let expected = mean_of_colours(|wavelength| passes(wavelength) * place(wavelength)) / passing;
    let exact = 0.04 * incidence.cos() * passing;
    let device = Device::open();
    let mut on_mesh = with_texels(scene.clone(), "floor", [256, 256]);
    let mesh = scene.objects[0].geometry.mesh().into_owned();
    on_mesh.objects[0].geometry = Geometry::Mesh(mesh.into());
    // Area and x of every texel.
    let texel_area = floor.area() / f64::from(TEXELS[0] * TEXELS[1]);
    let of_rect: Vec<_> = (0..TEXELS[0] * TEXELS[1])
        .map(|texel| {
            let column = f64::from(texel % TEXELS[0]) + 0.5;
            (texel_area, floor.origin.x + column / f64::from(TEXELS[0]))
        })
        .collect();
    let of_mesh = (texels(&on_mesh, "floor").1.iter())
        .map(|texel| (texel.area, texel.position.x))
        .collect();
    let on_rect = [Method::Footprint, Method::Points].map(|kind| method(kind, 65_536));
    // Every ray leaves a footprint for each of its wavelengths on a mesh.
    let on_triangles = [footprint(16_384)];
    for (scene, texels, all) in [
        (scene, of_rect, &on_rect[..]),
        (on_mesh, of_mesh, &on_triangles),
    ] {
        for settings in all {
            let map = device.caustic(&scene, "floor", settings);
            let [mut at, mut flux] = [DVec3::ZERO; 2];
            for ((area, x), value) in texels.iter().zip(&map.pixels) {
                let value = *area * DVec3::from(value.map(f64::from));
                at += value * *x;
                flux += value;
            }
            println!(
                "{:?}: {} for {expected}, {flux} W for {exact}",
                settings.method,
                at / flux
            );
            assert!((at / flux - expected).abs().max_element() < 2e-4);
            assert!((flux / exact - 1.0).abs().max_element() < 0.005);
        }
    }
}

#[test]
fn a_prism_bends_each_channel_by_snells_law() {
    let (scene, incidence) = prism();
    let glass = Dispersion::Sellmeier(GLASSES[0].1);
    let at = |wavelength| deviation(incidence, glass.index(wavelength));
    let shift = |wavelength| DISTANCE * (at(wavelength) - at(spectrum::MIDDLE)).tan();
    let passes = |wavelength| transmittance(incidence, glass.index(wavelength));
    let passing = mean_of_colours(passes);
    let expected = mean_of_colours(|wavelength| passes(wavelength) * shift(wavelength)) / passing;
    let device = Device::open();
    for (settings, bound, bound_of_colour) in [
        (footprint(16_384), 0.005, 0.001),
        (method(Method::Points, 65_536), 0.01, 0.006), // with their noise
    ] {
        let map = device.caustic(&scene, "wall", &settings);
        let [found, sum] = places(&map);
        // From red to green and from green to blue: the middle depends on where light enters the prism.
        for channel in 0..2 {
            let apart = |place: DVec3| place[channel + 1] - place[channel];
            let error = apart(found) / apart(expected) - 1.0;
            println!("{:?}: {} m, {error:.4}", settings.method, apart(expected));
            assert!(error.abs() < bound, "{:?}: {error}", settings.method);
        }
        // The more of a colour is reflected, the less passes.
        assert_colour(sum, passing, bound_of_colour);
    }
}

/// The scene, whose spectrum is so wide that lattices carry a band of it each. Its slit lets an eighth of the lattice pass, with edges as
/// sharp as a cell.
#[test]
fn against_the_reference() {
    let texels = [192, 80];
    let scene = only_receiver(load_with_chains("prism.toml"), "wall", texels);
    let truth = solve(&scene, "wall", texels, &options(0.04));
    let truth_map = truth.image();
    let settings = Settings {
        error: Some(0.01),
        ..footprint(16_384)
    };
    let device = Device::open();
    let map = device.caustic(&scene, "wall", &settings);
    let mut undispersed = scene.clone();
    for material in &mut undispersed.materials {
        if let MaterialKind::Dielectric(medium) = &mut material.kind {
            medium.dispersion = None;
        }
    }
    let without = device.caustic(&undispersed, "wall", &settings);
    let (error, perturbed) = (l1(&map, &truth_map), l1(&without, &truth_map));
    println!("{error} beside noise of {}", l1_noise(&truth));
    assert_error_beyond_noise("prism", 0.1, l1_noise(&truth), error, perturbed);
}
