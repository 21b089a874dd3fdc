//! Light of several surfaces on mesh receivers: against the reference, behind thin walls, and in the balance of flux.

use crate::common::glass::block;
use crate::common::{
    Device, assert_error_beyond_noise, assert_physical, balance, flux_noise, footprint, l1,
    l1_noise, load_with_chains, mesh_receiver, moved, object_mut, options, solve, texels,
    with_sun_of,
};
use crate::flux_balance::assert_adds_up;
use glam::{DVec2, DVec3};
use nephroid::image_file::RgbImage;
use nephroid::optics::fresnel_dielectric;
use nephroid::render::{Renderer, Settings};
use nephroid::scene::{LightKind, MaterialKind, Mesh, Scene, Texel};

const SIZE: [u32; 2] = [64, 64];

/// A sheet with bumps and dents, about 50 mm below the floor of the scenes.
fn sheet() -> Mesh {
    const CELLS: u32 = 64;
    let mut mesh = Mesh::default();
    for j in 0..=CELLS {
        for i in 0..=CELLS {
            let place = 2.0 * DVec2::new(f64::from(i), f64::from(j)) / f64::from(CELLS);
            let [x, z] = [place.x - 0.5, 1.0 - place.y];
            let height = 0.04 * (7.0 * x).sin() * (6.0 * z).cos() - 0.06;
            mesh.positions.push(DVec3::new(x, height, z));
            mesh.normals.push(DVec3::Y);
        }
    }
    for j in 0..CELLS {
        for i in 0..CELLS {
            let a = j * (CELLS + 1) + i;
            let [b, c, d] = [a + 1, a + CELLS + 2, a + CELLS + 1];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh
}

/// The casters of the scene, and its floor unless it is replaced, with light maps on `receivers` alone.
fn with_receivers(name: &str, receivers: Vec<Mesh>, replaces_floor: bool) -> Scene {
    let mut scene = load_with_chains(name);
    let material = scene.objects[scene.object_index("floor").unwrap()].material;
    scene.objects.retain(|object| {
        let is_caster = scene.materials[object.material].kind.is_specular();
        is_caster || !replaces_floor && object.name == "floor"
    });
    for object in &mut scene.objects {
        object.light_map = None;
    }
    for (mesh, number) in receivers.into_iter().zip(0..) {
        let name = format!("receiver {number}");
        let object = mesh_receiver(&name, material, mesh, vec![], SIZE);
        scene.objects.push(object);
    }
    scene
}

/// W, in green.
fn flux(map: &RgbImage, texels: &[Texel]) -> f64 {
    (map.pixels.iter().zip(texels))
        .map(|(rgb, texel)| f64::from(rgb[1]) * texel.area)
        .sum()
}

/// A ball of `radius` around `place`, m.
fn globe(radius: f64, place: DVec3) -> Mesh {
    let scene = load_with_chains("globe.toml");
    let ball = scene.objects[scene.object_index("globe").unwrap()].clone();
    let mut mesh = ball.geometry.mesh().into_owned();
    let bounds = mesh.bounds();
    let middle = 0.5 * (bounds[0] + bounds[1]);
    let own = 0.5 * (bounds[1].x - bounds[0].x);
    for position in &mut mesh.positions {
        *position = place + radius / own * (*position - middle);
    }
    mesh
}

/// L1, against which the light of a single surface alone is far off, and flux.
#[track_caller]
fn assert_is_reference(
    what: &str,
    scene: &Scene,
    reference_error: f64,
    bound: f64,
    energy_bound: f64,
) {
    let name = "receiver 0";
    let device = Device::open();
    let settings = Settings {
        error: Some(0.02),
        ..footprint(16_384)
    };
    let reference = solve(scene, name, SIZE, &options(reference_error));
    let truth = reference.image();
    let map = device.caustic(scene, name, &settings);
    assert_physical(&map);
    let one = Scene {
        max_interfaces: 1,
        ..scene.clone()
    };
    let without = device.caustic(&one, name, &settings);
    assert_error_beyond_noise(
        &format!("{what}, L1"),
        bound,
        l1_noise(&reference),
        l1(&map, &truth),
        l1(&without, &truth),
    );
    let (_, texels) = texels(scene, name);
    let exact = flux(&truth, &texels);
    let found = flux(&map, &texels) / exact;
    let noise = flux_noise(&reference, texels.iter().map(|texel| texel.area))[1] / exact;
    // More light lands in the same places.
    let energy = |factor: f64| (factor * found - 1.0).abs();
    assert_error_beyond_noise(
        &format!("{what}, energy"),
        energy_bound,
        noise,
        energy(1.0),
        energy(1.0 + 3.0 * energy_bound),
    );
}

/// A glass ball, which disperses light, a tumbler with a drink, and a half ring before a flat mirror, over a bumpy sheet that is the
/// only receiver.
#[test]
fn a_sheet_is_lit_as_in_the_reference() {
    for (name, reference_error, bound, energy_bound) in [
        ("glass_ball.toml", 0.02, 0.04, 0.01),
        ("tumbler.toml", 0.03, 0.11, 0.015),
        ("two_mirrors.toml", 0.02, 0.06, 0.01),
    ] {
        let scene = with_receivers(name, vec![sheet()], true);
        assert_is_reference(name, &scene, reference_error, bound, energy_bound);
    }
}

/// A globe in the light of a glass ball, over a floor without a light map.
#[test]
fn a_globe_is_lit_as_in_the_reference() {
    let place = DVec3::new(0.75, 0.25, 0.0);
    let mut scene = with_receivers("glass_ball.toml", vec![globe(0.2, place)], false);
    scene = moved(scene, "ball", 0.0, 0.2 * DVec3::Y);
    assert_is_reference("globe", &scene, 0.02, 0.05, 0.01);
    // A wide sun has another kernel.
    assert_is_reference(
        "globe, wide sun",
        &with_sun_of(scene, 2.5),
        0.02,
        0.05,
        0.01,
    );
}

/// The light below a plate of glass on the upper of two plates with closed surfaces, 4 mm thick: its far side and the plate behind it
/// get nothing. Their sides are left out: the light grazes them, and there the shadow of what is near is not told from that of the
/// surface itself.
#[test]
fn nothing_reaches_the_far_side_of_a_thin_wall() {
    let wall = |half: f64, top: f64| {
        let (low, high) = (
            DVec3::new(-half, top - 0.004, -half),
            DVec3::new(half, top, half),
        );
        block(low, high).mesh().into_owned()
    };
    let mut scene = with_receivers(
        "glass_ball.toml",
        vec![wall(0.3, 0.0), wall(0.2, -0.05)],
        true,
    );
    let plate = block(DVec3::new(-0.5, 0.3, -0.5), DVec3::new(0.5, 0.4, 0.5));
    object_mut(&mut scene, "ball").geometry = plate;
    let toward = DVec3::new(0.1, 1.0, 0.0).normalize();
    let LightKind::Sun {
        direction,
        irradiance,
        ..
    } = &mut scene.lights[0].kind
    else {
        panic!("a sun");
    };
    *direction = toward;
    let irradiance = irradiance.y;
    let names = ["receiver 0", "receiver 1"];
    let maps = Device::open().caustics(&scene, &names, &footprint(16_384));
    let glass = match scene.materials[scene.objects[0].material].kind {
        MaterialKind::Dielectric(medium) => medium.ior,
        _ => panic!("glass"),
    };
    let f = fresnel_dielectric(toward.y, 1.0 / glass);
    // Light that is reflected inside an even number of times is added.
    let exact = irradiance * toward.y * (1.0 - f) / (1.0 + f);
    let (atlas, upper) = texels(&scene, names[0]);
    let (_, behind) = texels(&scene, names[1]);
    let mut lit = 0;
    for (index, texel) in upper.iter().enumerate() {
        if atlas.pieces(index).is_empty() {
            continue;
        }
        let found = f64::from(maps[0].pixels[index][1]);
        if texel.normal.y < -0.5 {
            assert_eq!(maps[0].pixels[index], [0.0; 3], "the far side, {index}");
        }
        let inside = texel.position.abs().max_element() < 0.25;
        if texel.normal.y > 0.999 && inside {
            lit += 1;
            assert!(
                (found / exact - 1.0).abs() < 0.02,
                "{index}: {found}, exact {exact}"
            );
        }
    }
    assert!(lit > 100, "{lit}");
    for (index, texel) in behind.iter().enumerate() {
        if texel.normal.y.abs() > 0.999 {
            assert_eq!(maps[1].pixels[index], [0.0; 3], "behind the wall, {index}");
        }
    }
}

/// The light maps of a frame.
fn maps(renderer: &mut Renderer, scene: &Scene) -> Vec<[f32; 3]> {
    renderer.invalidate();
    renderer.caustic().unwrap();
    (scene.light_maps().into_iter())
        .flat_map(|(receiver, _)| renderer.read_caustic(receiver).unwrap().pixels)
        .collect()
}

/// Frames have equal bits, whichever earlier frames there were, and a balance of flux in between.
#[test]
fn equal_scenes_have_equal_bits() {
    let scene = with_receivers("glass_ball.toml", vec![sheet()], true);
    let away = moved(scene.clone(), "ball", 0.0, DVec3::new(0.0, 0.1, 0.2));
    let device = Device::open();
    let mut renderer = device.renderer(&scene, &footprint(4096));
    let first = maps(&mut renderer, &scene);
    renderer.update(&away).unwrap();
    assert_ne!(maps(&mut renderer, &away), first);
    renderer.flux_balance().unwrap().unwrap();
    renderer.update(&scene).unwrap();
    assert_eq!(maps(&mut renderer, &scene), first);
}

/// Light on meshes has landed, as in the reference, and nothing is left out.
#[test]
fn the_balance_of_flux_has_it() {
    for (name, bound) in [("glass_ball.toml", 0.006), ("two_mirrors.toml", 0.006)] {
        let scene = with_receivers(name, vec![sheet()], true);
        let truth = balance(&scene, 0).mean;
        let settings = Settings {
            error: Some(0.02),
            ..Settings::default()
        };
        let device = Device::open();
        let mut renderer = device.renderer(&scene, &settings);
        let balance = renderer.flux_balance().unwrap().expect("chains");
        assert_adds_up(name, &balance);
        for surfaces in [1, 2] {
            let [found, exact] = [&balance, &truth].map(|of| of.share(of.landed[surfaces]));
            println!(
                "{name}, after {}: {found:.5}, reference {exact:.5}",
                surfaces + 1
            );
            assert!((found - exact).abs() < bound, "{name}: {found}, {exact}");
        }
        assert!(balance.share(balance.landed[1]) > 0.1, "{name}");
        assert_eq!(balance.cut_off.room, [0.0; 3], "{name}");
        // Nothing that meshes do is left out; only an error of their light is not estimated.
        let is_known = |note: &String| note.starts_with("no error is estimated");
        let notes = renderer.notes();
        assert!((notes.iter()).all(|note| is_known(note) || !note.contains("meshes")));
    }
}
