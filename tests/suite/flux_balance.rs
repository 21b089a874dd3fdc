//! Where the light of chains ends: what is lost is said, and all of it adds up to what came in.

use crate::common::glass::{self, block};
use crate::common::{
    Device, assert_error_beyond_noise, balance, footprint, load_with_chains, set_light_maps,
    shipped,
};
use glam::DVec3;
use nephroid::flux_balance::{Flux, FluxBalance};
use nephroid::optics::fresnel_dielectric;
use nephroid::reference;
use nephroid::render::{Method, Renderer, Settings};
use nephroid::scene::{Dielectric, Geometry, MaterialKind, Rect, Scene};
use std::slice::from_ref;

/// As on the command line.
fn settings() -> Settings {
    Settings {
        error: Some(0.02),
        ..Settings::default()
    }
}

fn by_device(scene: &Scene, settings: &Settings) -> Option<FluxBalance> {
    Device::open()
        .renderer(scene, settings)
        .flux_balance()
        .unwrap()
}

/// Bits of the light maps of a frame.
fn maps(renderer: &mut Renderer, scene: &Scene) -> Vec<[f32; 3]> {
    renderer.invalidate();
    renderer.caustic().unwrap();
    (scene.light_maps().into_iter())
        .flat_map(|(receiver, _)| renderer.read_caustic(receiver).unwrap().pixels)
        .collect()
}

/// Where light ends adds up to the light that comes in.
#[track_caller]
pub fn assert_adds_up(name: &str, balance: &FluxBalance) {
    let [incoming, outgoing] = [balance.incoming, balance.outgoing()];
    for channel in 0..3 {
        let sum = outgoing[channel] / incoming[channel];
        assert!((sum - 1.0).abs() < 1e-5, "{name}: {sum}");
    }
}

/// Of the sum itself, rounding is all that is missing. What sub-lattices of weak lobes leave is small.
#[test]
fn adds_up_on_every_shipped_scene() {
    let device = Device::unwatched();
    let mut with_chains = 0;
    for name in shipped() {
        let mut scene = load_with_chains(&name);
        set_light_maps(&mut scene, [64, 64]);
        let mut renderer = device.renderer(&scene, &settings());
        let found = renderer.flux_balance().unwrap();
        assert_eq!(found.is_some(), renderer.may_chain(), "{name}");
        let Some(balance) = found else { continue };
        with_chains += 1;
        assert_adds_up(&name, &balance);
        let sampling = balance.share(balance.sampling);
        let lost = balance.share(balance.cut_off.total());
        println!("{name}: cut off {lost:.5}, sampling {sampling:.5}");
        assert!(sampling.abs() < 0.01, "{name}: {sampling}");
    }
    assert!(with_chains > 10, "{with_chains}");
}

/// The entries that both have, and the flux that comes in: the one that is the farthest off with `factor` times as much light, over
/// the flux that comes in, and the reference's standard error of it.
fn worst(found: &FluxBalance, factor: f64, truth: &reference::FluxReference) -> (f64, f64) {
    let total = |flux: &Flux| flux.iter().sum::<f64>();
    let incoming = total(&truth.mean.incoming);
    let errors = ENTRIES.map(|(what, entry)| {
        let sum = |of| entry(of).iter().map(total).sum::<f64>() / incoming;
        let (found, exact) = (factor * sum(found), sum(&truth.mean));
        // The channels of a ray change together; what it adds to one entry it does not add to others.
        let parts = entry(&truth.standard_error).iter();
        let noise = parts.map(|flux| total(flux).powi(2)).sum::<f64>().sqrt() / incoming;
        println!("    {what}: {found:.5}, reference {exact:.5} ± {noise:.5}");
        ((found - exact).abs(), noise)
    });
    let bad = |(error, noise): &(f64, f64)| error + 3.0 * noise;
    errors
        .into_iter()
        .max_by(|a, b| bad(a).total_cmp(&bad(b)))
        .unwrap()
}

#[test]
fn agrees_with_the_reference() {
    for (name, bound) in [
        ("glass_ball.toml", 0.005),
        ("tumbler.toml", 0.008),
        ("wine.toml", 0.008),
        ("two_mirrors.toml", 0.005),
        ("prism.toml", 0.025),
    ] {
        let scene = load_with_chains(name);
        let truth = balance(&scene, 0);
        assert_adds_up(name, &truth.mean);
        let balance = by_device(&scene, &settings()).unwrap();
        let (error, noise) = worst(&balance, 1.0, &truth);
        // More light ends in the same places.
        let (perturbed, _) = worst(&balance, 1.0 + 4.0 * bound, &truth);
        assert_error_beyond_noise(name, bound, noise, error, perturbed);
    }
}

/// As many rays as a lattice may have: the light that comes in stays the same.
#[test]
fn many_rays_bring_the_same_light() {
    let scene = load_with_chains("two_mirrors.toml");
    let [few, many] = [16_384, 262_144].map(|samples| by_device(&scene, &footprint(samples)));
    let total = |of: Option<FluxBalance>| of.unwrap().incoming.iter().sum::<f64>();
    let ratio = total(many) / total(few);
    assert!((ratio - 1.0).abs() < 0.003, "{ratio}");
}

/// A part of the light, or several.
type Entry = fn(&FluxBalance) -> &[Flux];

const ENTRIES: [(&str, Entry); 11] = [
    ("incoming", |of| from_ref(&of.incoming)),
    ("landed after 1", |of| &of.landed[..1]),
    ("landed after 2", |of| &of.landed[1..2]),
    ("landed after 3", |of| &of.landed[2..3]),
    ("landed after 4", |of| &of.landed[3..4]),
    ("landed", |of| &of.landed),
    ("on other surfaces", |of| from_ref(&of.on_other_surfaces)),
    ("absorbed by media", |of| from_ref(&of.absorbed_by_media)),
    ("absorbed by mirrors", |of| {
        from_ref(&of.absorbed_by_mirrors)
    }),
    ("left", |of| from_ref(&of.left_scene)),
    ("cut off after the last interface", |of| {
        from_ref(&of.cut_off.interfaces)
    }),
];

/// A plate that absorbs, under light along its normal: with F the reflectance of a face and T the transmittance of the medium,
/// F + (1 − F)² F T²/(1 − F² T²) is reflected, and (1 − F)² T/(1 − F² T²) arrives below.
#[test]
fn absorbing_slab() {
    let absorption = DVec3::new(3.0, 0.5, 10.0);
    let thickness = 0.1;
    let plate = block(
        DVec3::new(-0.2, 0.1, -0.2),
        DVec3::new(0.2, 0.1 + thickness, 0.2),
    );
    let floor = Rect {
        origin: DVec3::new(-0.5, 0.0, 0.5),
        edge_u: DVec3::X,
        edge_v: DVec3::NEG_Z,
    };
    let dielectric = Dielectric {
        absorption,
        ..Dielectric::new(1.5)
    };
    let scene = glass::scene(
        DVec3::Y,
        floor,
        vec![(MaterialKind::Dielectric(dielectric), plate)],
    );
    let f = fresnel_dielectric(1.0, 1.0 / 1.5);
    let device = by_device(&scene, &footprint(16_384)).unwrap();
    let reference = balance(&scene, 0).mean;
    for (what, balance, bound) in [("device", device, 0.002), ("reference", reference, 0.001)] {
        assert_adds_up(what, &balance);
        for channel in 0..3 {
            let t = (-thickness * absorption[channel]).exp();
            let series = 1.0 - f * f * t * t;
            let reflected = f + (1.0 - f).powi(2) * f * t * t / series;
            let transmitted = (1.0 - f).powi(2) * t / series;
            let share = |flux: Flux| flux[channel] / balance.incoming[channel];
            for (entry, found, exact) in [
                ("incoming", balance.incoming[channel], 0.16),
                ("reflected", share(balance.left_scene), reflected),
                ("transmitted", share(balance.total_landed()), transmitted),
                (
                    "without reflection",
                    share(balance.landed[1]),
                    (1.0 - f).powi(2) * t,
                ),
                (
                    "absorbed",
                    share(balance.absorbed_by_media),
                    1.0 - reflected - transmitted,
                ),
            ] {
                println!("{what}, {entry}: {found:.5}, exact {exact:.5}");
                assert!(
                    (found - exact).abs() < bound,
                    "{what}, {entry}: {found}, exact {exact}"
                );
            }
        }
    }
}

/// Light between two parallel mirrors that face each other never ends. It is cut off after 16 surfaces, and each of these absorbed
/// its part.
#[test]
fn parallel_mirrors() {
    let reflectance = 0.98;
    let mirror = |y: f64, from: f64, upward: f64| {
        let rect = Rect {
            origin: DVec3::new(from, y, 0.1 * upward),
            edge_u: (10.0 - from) * DVec3::X,
            edge_v: -0.2 * upward * DVec3::Z,
        };
        let polished = MaterialKind::Mirror {
            reflectance: DVec3::splat(reflectance),
        };
        (polished, Geometry::Rect(rect))
    };
    let end = Rect {
        origin: DVec3::new(10.05, -0.1, -0.15),
        edge_u: 0.3 * DVec3::Z,
        edge_v: 0.3 * DVec3::Y,
    };
    let mirrors = vec![mirror(0.0, 0.0, 1.0), mirror(0.1, 0.02, -1.0)];
    let scene = Scene {
        max_interfaces: 16,
        ..glass::scene(DVec3::new(-0.5, 1.0, 0.0), end, mirrors)
    };
    let device = by_device(&scene, &footprint(16_384)).unwrap();
    for (what, balance) in [("device", device), ("reference", balance(&scene, 0).mean)] {
        assert_adds_up(what, &balance);
        let cut_off = balance.share(balance.cut_off.interfaces);
        let absorbed = balance.share(balance.absorbed_by_mirrors);
        let left = reflectance.powi(16);
        assert!(
            (cut_off - left).abs() < 1e-3,
            "{what}: {cut_off}, exact {left}"
        );
        assert!((absorbed - (1.0 - left)).abs() < 1e-3, "{what}: {absorbed}");
    }
}

/// Light is counted in passes of its own: the frames before and after it, and those of a renderer that is not asked, are the same,
/// and so are the balances.
#[test]
fn frames_keep_their_bits() {
    let scene = load_with_chains("tumbler.toml");
    let device = Device::open();
    let mut asked = device.renderer(&scene, &footprint(4096));
    let before = maps(&mut asked, &scene);
    let first = asked.flux_balance().unwrap();
    let after = maps(&mut asked, &scene);
    let second = asked.flux_balance().unwrap();
    assert!(before == after);
    assert_eq!(first, second);
    assert!(first.is_some_and(|balance| balance.share(balance.cut_off.total()) > 1e-3));
    let mut not_asked = device.renderer(&scene, &footprint(4096));
    assert!(maps(&mut not_asked, &scene) == after);
}

#[test]
fn other_methods_have_none() {
    let scene = load_with_chains("glass_ball.toml");
    let settings = crate::common::method(Method::Points, 4096);
    assert_eq!(by_device(&scene, &settings), None);
}
