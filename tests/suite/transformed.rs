//! Scenes in other places and of other sizes, several suns, no sun for the mirror.

use crate::common::{
    Device, assert_error, assert_physical, flux, footprint, l1, load, method, object_mut,
    ratio_error, rect, with_texels,
};
use glam::DVec3;
use nephroid::render::Method;
use nephroid::scene::{Geometry, LightKind, Scene};

/// E does not depend on where a scene is and how large: nothing in it has a length of its own.
/// (Points that are rounded otherwise are other points, so only their noise would be compared.)
#[test]
fn place_and_size_do_not_matter() {
    let device = Device::open();
    let scene = with_texels(load("ring.toml"), "floor", [128, 128]);
    let far = 1e4 * DVec3::new(1.0, -1.0, 0.7);
    let off_by_a_texel = crate::common::shifted_by_a_texel(scene.clone(), "floor");
    for method_ in [Method::Footprint, Method::Beams] {
        let settings = method(method_, 16_384);
        let map = |scene: &Scene| device.caustic(scene, "floor", &settings);
        let here = map(&scene);
        let perturbed = l1(&map(&off_by_a_texel), &here);
        for (what, scale, shift) in [
            ("moved by 10 km", 1.0, far),
            ("a thousandth", 1e-3, DVec3::ZERO),
            ("a thousand times", 1e3, DVec3::ZERO),
        ] {
            let there = map(&scene.clone().transformed(scale, shift));
            assert_physical(&there);
            let what = format!("ring, {method_:?}, {what}, L1");
            assert_error(&what, 0.002, l1(&there, &here), perturbed);
        }
    }
}

fn two_suns() -> Scene {
    let mut scene = load("mirror.toml");
    let mut second = scene.lights[0].clone();
    second.name = "second sun".into();
    if let LightKind::Sun {
        direction,
        irradiance,
        ..
    } = &mut second.kind
    {
        *direction = DVec3::new(0.1, 0.9, 0.7).normalize();
        *irradiance = DVec3::new(0.5, 2.0, 1.0);
    }
    scene.lights.push(second);
    scene
}

/// All light that a flat mirror reflects lands on the floor: ρ A (E₁ n·s₁ + E₂ n·s₂).
#[test]
fn light_of_several_suns_adds_up() {
    let device = Device::open();
    let scene = two_suns();
    let floor = rect(&scene, "floor");
    let [cos1, cos2] =
        [DVec3::new(0.3, 0.8, 0.6), DVec3::new(0.1, 0.9, 0.7)].map(|s| s.normalize().z);
    let exact = [(0.9, 0.5), (0.8, 2.0), (0.7, 1.0)]
        .map(|(reflectance, second)| reflectance * 0.48 * (cos1 + second * cos2));
    for settings in [
        footprint(16_384),
        method(Method::Points, 500_000),
        method(Method::Beams, 16_384),
    ] {
        let energy = |scene: &Scene| {
            let map = device.caustic(scene, "floor", &settings);
            assert_physical(&map);
            ratio_error(flux(&map, &floor), exact)
        };
        let mut brighter = scene.clone();
        if let LightKind::Sun { irradiance, .. } = &mut brighter.lights[1].kind {
            *irradiance *= 1.01;
        }
        let what = format!("two suns, energy, {:?}", settings.method);
        assert_error(&what, 0.001, energy(&scene), energy(&brighter));
    }
}

/// The caustic of two suns is the sum of their caustics.
#[test]
fn caustics_of_several_suns_add_up() {
    let device = Device::open();
    let both = two_suns();
    let settings = footprint(65_536);
    let mut sum = device.caustic(&both, "floor", &settings);
    sum.pixels.iter_mut().for_each(|rgb| *rgb = [0.0; 3]);
    for light in 0..2 {
        let mut one = both.clone();
        one.lights = vec![both.lights[light].clone()];
        let map = device.caustic(&one, "floor", &settings);
        for (sum, rgb) in sum.pixels.iter_mut().zip(&map.pixels) {
            (0..3).for_each(|c| sum[c] += rgb[c]);
        }
    }
    let error = |scene: &Scene| l1(&device.caustic(scene, "floor", &settings), &sum);
    let perturbed = error(&crate::common::brighter(both.clone(), 1.001));
    // The same patches, so only the order of additions differs.
    assert_error("two suns, L1 to their sum", 1e-4, error(&both), perturbed);
}

/// So many that all patches and suns of a texel are more than the turns of a loop that lavapipe
/// allows.
#[test]
fn pinhole_sums_over_many_suns() {
    let device = Device::open();
    let one = with_texels(load("mirror.toml"), "floor", [16, 16]);
    let split = |count: u32| {
        let mut scene = crate::common::brighter(one.clone(), 1.0 / 64.0);
        scene.lights = vec![scene.lights[0].clone(); count as usize];
        scene
    };
    let map = |scene: &Scene| device.caustic(scene, "floor", &method(Method::Pinhole, 2048));
    let truth = map(&one);
    let [all, without_one] = [64, 63].map(|count| l1(&map(&split(count)), &truth));
    assert_error("pinhole, 64 suns, L1 to one", 1e-4, all, without_one);
}

#[test]
fn a_mirror_that_faces_no_light_reflects_none_and_says_so() {
    let device = Device::open();
    let lit = with_texels(load("mirror.toml"), "floor", [32, 32]);
    let mut turned = lit.clone();
    if let Geometry::Rect(rect) = &mut object_mut(&mut turned, "mirror").geometry {
        std::mem::swap(&mut rect.edge_u, &mut rect.edge_v);
    }
    let mut no_light = lit.clone();
    no_light.lights.clear();
    let mut no_mirror = lit.clone();
    no_mirror.objects.retain(|object| object.name != "mirror");
    let dark = |scene: &Scene, method_| {
        let mut renderer = device.renderer(scene, &method(method_, 4096));
        renderer.caustic().unwrap();
        let floor = scene.object_index("floor").unwrap();
        let map = renderer.read_caustic(floor).unwrap();
        let noted = (renderer.notes().iter())
            .any(|note| note.contains("casts no caustic: all of its faces look away"));
        let black = map.pixels.iter().all(|rgb| *rgb == [0.0; 3]);
        assert_eq!(noted, black, "{:?}", renderer.notes());
        renderer.view(&scene.camera, [16, 16], 1).unwrap();
        assert_physical(&renderer.read_view().unwrap());
        black
    };
    for method in [
        Method::Footprint,
        Method::Points,
        Method::Pinhole,
        Method::Beams,
    ] {
        assert!(dark(&turned, method));
        assert!(dark(&no_light, method));
        let mut renderer = device.renderer(&no_mirror, &self::method(method, 4096));
        renderer.caustic().unwrap();
        let notes = renderer.notes();
        let expected = "no caustic: nothing in the scene reflects or refracts light";
        assert!(notes.iter().any(|note| note == expected), "{notes:?}");
        assert!(!dark(&lit, method));
    }
}
