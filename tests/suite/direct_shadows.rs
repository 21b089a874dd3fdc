//! Shadows in the maps of direct light, against closed forms, and views that use them.

use crate::common::{
    Device, assert_error, bits, footprint, l1, load, middles, moved, object_mut, set_light_maps,
    toward_sun, with_texels,
};
use glam::DVec3;
use nephroid::render::Renderer;
use nephroid::scene::{Camera, Geometry, LightKind, MaterialKind, Object, Rect, Scene};
use std::f64::consts::PI;

/// The floor of mirror.toml under a sun in the zenith of this angular radius, and a blocker in place of its mirror.
fn under_zenith(radius: f64, blocker: Rect, texels: [u32; 2]) -> Scene {
    let mut scene = load("mirror.toml");
    if let LightKind::Sun {
        direction,
        angular_radius,
        ..
    } = &mut scene.lights[0].kind
    {
        (*direction, *angular_radius) = (DVec3::Y, radius);
    }
    let floor = scene.objects[scene.object_index("floor").unwrap()].clone();
    object_mut(&mut scene, "floor").light_map = Some(texels);
    let mirror = object_mut(&mut scene, "mirror");
    *mirror = Object {
        name: "mirror".into(),
        geometry: Geometry::Rect(blocker),
        light_map: None,
        ..floor
    };
    scene
}

fn rect(origin: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]) -> Rect {
    let [origin, edge_u, edge_v] = [origin, edge_u, edge_v].map(DVec3::from);
    Rect {
        origin,
        edge_u,
        edge_v,
    }
}

/// A half-plane at the height h under a disc of the radius α hides a segment of it: what is lit at the distance x from the
/// edge is 1/2 + (u √(1 − u²) + asin u)/π, u = x/(h tan α).
#[test]
fn penumbra_of_a_straight_edge() {
    let device = Device::open();
    let (height, radius, texels) = (0.5, 0.05f64, [128, 128]);
    let error = |edge: f64, halvings: u32| {
        let blocker = rect([edge, height, 3.0], [5.0, 0.0, 0.0], [0.0, 0.0, -6.0]);
        let scene = under_zenith(radius, blocker, texels);
        let map = device.coarse_direct(&scene, "floor", halvings);
        let places = middles(&scene, "floor", texels);
        let lit = |x: f64| {
            let u = (-x / (height * radius.tan())).clamp(-1.0, 1.0);
            0.5 + (u * (1.0 - u * u).sqrt() + u.asin()) / PI
        };
        (places.iter().zip(&map.pixels))
            .map(|(place, rgb)| (f64::from(rgb[0]) - lit(place.x + 0.2037)).abs())
            .fold(0.0, f64::max)
    };
    // Sixteen rays for a texel, whose side is a sixteenth of the penumbra's half width, and an eighth or a quarter of it in motion.
    for (halvings, bound) in [(0, 0.05), (1, 0.1), (2, 0.12)] {
        assert_error(
            "penumbra of an edge",
            bound,
            error(-0.2037, halvings),
            error(-0.2037 + 0.005, halvings),
        );
    }
}

/// Thirty suns in one place, more than have bits of their own in a texel, are one sun.
#[test]
fn many_suns_are_one() {
    let device = Device::open();
    let blocker = rect([-0.2, 0.5, 0.3], [5.0, 0.0, 0.0], [0.4, 0.0, -0.6]);
    let one = under_zenith(0.05, blocker, [128, 128]);
    let split = |share: f64| {
        let mut scene = one.clone();
        if let LightKind::Sun { irradiance, .. } = &mut scene.lights[0].kind {
            *irradiance *= share / 30.0;
        }
        scene.lights = vec![scene.lights[0].clone(); 30];
        scene
    };
    for halvings in [0, 1, 2] {
        let exact = device.coarse_direct(&one, "floor", halvings);
        let [error, perturbed] = [1.0, 31.0 / 30.0].map(|share| {
            l1(
                &device.coarse_direct(&split(share), "floor", halvings),
                &exact,
            )
        });
        assert_error("thirty suns", 1e-3, error, perturbed);
    }
}

/// A strip of a fifth of a texel's width hides its area, wherever it lies between the rays.
#[test]
fn thin_blockers_are_not_lost() {
    let device = Device::open();
    let texels = [128, 128];
    let side = 1.6 / 128.0;
    let hidden = |width: f64, shift: f64, halvings: u32| {
        // Slightly turned, so that it passes all places within a texel.
        let strip = rect(
            [-0.2 + shift * side, 0.02, 0.9],
            [width, 0.0, 0.0],
            [0.05, 0.0, -1.0],
        );
        let scene = under_zenith(0.0, strip, texels);
        let map = device.coarse_direct(&scene, "floor", halvings);
        let missing: f64 = map.pixels.iter().map(|rgb| 1.0 - f64::from(rgb[0])).sum();
        missing * side * side / (width * 1.0)
    };
    for (shift, halvings) in [(0.0, 0), (0.37, 0), (0.0, 1), (0.37, 1)] {
        let width = 0.2 * side;
        let [error, perturbed] =
            [1.0, 1.2].map(|factor| (hidden(factor * width, shift, halvings) * factor - 1.0).abs());
        assert_error("shadow of a thin strip", 0.1, error, perturbed);
    }
}

/// A frame in which only the camera moved is that of a renderer that was made for it, bit by bit; and a light that moved
/// moves its shadows.
#[test]
fn the_camera_moves_alone() {
    let device = Device::open();
    let mut scene = load("ring.toml");
    for texels in scene
        .objects
        .iter_mut()
        .filter_map(|object| object.light_map.as_mut())
    {
        *texels = [64, 64];
    }
    let size = [64, 36];
    let fresh = |scene: &Scene| {
        let mut renderer = device.renderer(scene, &footprint(1024));
        renderer.view(&scene.camera, size, 2).unwrap();
        bits(&renderer.read_view().unwrap())
    };
    let mut renderer = device.renderer(&scene, &footprint(1024));
    renderer.view(&scene.camera, size, 2).unwrap();
    let first = bits(&renderer.read_view().unwrap());
    scene.camera.position += DVec3::new(0.3, 0.1, -0.2);
    renderer.update(&scene).unwrap();
    renderer.view(&scene.camera, size, 2).unwrap();
    let second = bits(&renderer.read_view().unwrap());
    assert_ne!(first, second);
    assert!(second == fresh(&scene), "only the camera moved");
    if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
        *direction = DVec3::new(-0.6, 0.6, 0.5).normalize();
    }
    renderer.update(&scene).unwrap();
    renderer.view(&scene.camera, size, 2).unwrap();
    let third = bits(&renderer.read_view().unwrap());
    assert_ne!(second, third);
    assert!(third == fresh(&scene), "the sun moved");
}

/// A box without a light map shows albedo/π E cos θ on the face toward the camera, and its flat faces are even.
#[test]
fn meshes_without_light_maps_are_lit() {
    let device = Device::open();
    let mut scene = load("blocker.toml");
    let post = scene.object_index("post").unwrap();
    let mesh = scene.objects[post].geometry.mesh().into_owned();
    let [low, high] = mesh.bounds();
    // The highest points are seen from above, and nothing is above them.
    let top = DVec3::new(0.5 * (low.x + high.x), high.y, 0.5 * (low.z + high.z));
    scene.camera.position = top + DVec3::new(0.01, 1.0, 0.01);
    scene.camera.target = top;
    scene.camera.fov = 1e-3;
    let material = scene.objects[post].material;
    let MaterialKind::Diffuse { albedo } = scene.materials[material].kind else {
        panic!("the post is diffuse");
    };
    let LightKind::Sun { irradiance, .. } = scene.lights[0].kind else {
        panic!("a sun");
    };
    let mut renderer = device.renderer(&scene, &footprint(1024));
    renderer.view(&scene.camera, [4, 4], 2).unwrap();
    let image = renderer.read_view().unwrap();
    let exact = albedo / PI * irradiance * toward_sun(&scene).y;
    let error = |factor: f64| {
        (image.pixels.iter())
            .map(|rgb| crate::common::ratio_error(rgb.map(f64::from), (factor * exact).to_array()))
            .fold(0.0, f64::max)
    };
    assert_error("top of the post", 0.02, error(1.0), error(1.05));
}

/// Pixels of an even surface do not depend on the number of samples, nor on the parts that the picture is computed in.
#[test]
fn parts_of_a_picture_fit_together() {
    let device = Device::open();
    let scene = load("mirror.toml");
    let view = |side| {
        let mut renderer = device.renderer(&scene, &footprint(1024));
        renderer.view(&scene.camera, [50, 45], side).unwrap();
        renderer.read_view().unwrap()
    };
    let [two, five] = [2, 5].map(view);
    let differs =
        |a: &[f32; 3], b: &[f32; 3]| (0..3).any(|c| (a[c] - b[c]).abs() > 0.02 * a[c].max(b[c]));
    let differing = (two.pixels.iter().zip(&five.pixels))
        .filter(|(a, b)| differs(a, b))
        .count();
    // The outlines of the mirror, of the floor and of what is mirrored.
    assert!((1..450).contains(&differing), "{differing} of 2250 pixels");
}

/// Maps that are coarse in motion have nearly the same light, and at rest the bits that they always have.
#[test]
fn maps_are_coarse_in_motion_alone() {
    maps_are_coarse_in_motion([256, 256], 1, 0.005);
}

/// The same where direct light has fewer texels than the light map of the caustic.
#[test]
fn maps_are_coarser_than_light_maps_in_motion() {
    maps_are_coarse_in_motion([511, 509], 2, 0.02);
}

fn maps_are_coarse_in_motion(texels: [u32; 2], halvings: u32, bound: f64) {
    let device = Device::open();
    let still = with_texels(load("ring.toml"), "floor", texels);
    let mut turned = still.clone();
    if let LightKind::Sun { direction, .. } = &mut turned.lights[0].kind {
        *direction = (*direction + 0.1 * DVec3::X).normalize();
    }
    let spun = moved(turned.clone(), "ring", 0.2, 0.1 * DVec3::Y);
    let floor = still.object_index("floor").unwrap();
    let direct = |renderer: &mut Renderer, scene: &Scene, halvings| {
        renderer.set_direct_halvings(halvings);
        renderer.update(scene).unwrap();
        renderer.direct().unwrap();
        renderer.read_direct(floor).unwrap()
    };
    let mut renderer = device.renderer(&still, &footprint(1));
    let fine = direct(&mut renderer, &still, 0);
    let kept = direct(&mut renderer, &still, halvings);
    assert!(bits(&kept) == bits(&fine), "they show the scene already");
    // The sun moves, for which the light of the environment is kept, and then what blocks it.
    for scene in [&turned, &spun] {
        let coarse = direct(&mut renderer, scene, halvings);
        let fine = direct(&mut renderer, scene, 0);
        assert!(bits(&fine) == bits(&device.direct(scene, "floor")));
        let l1 = l1(&coarse, &fine);
        assert!((1e-5..bound).contains(&l1), "{l1}");
    }
}

/// The light of the sky at points of the cup is kept while the sun moves, and found again under another sky and where the cup moves.
#[test]
fn light_of_the_sky_is_kept_at_points_of_meshes() {
    let device = Device::open();
    let mut still = load("coffee.toml");
    set_light_maps(&mut still, [64, 64]);
    for light in &mut still.lights {
        if let LightKind::Environment { casts_caustics, .. } = &mut light.kind {
            *casts_caustics = false;
        }
    }
    let points = (still.objects.iter())
        .find(|object| {
            let kind = &still.materials[object.material].kind;
            matches!(kind, MaterialKind::Diffuse { .. }) && object.light_map.is_none()
        })
        .unwrap();
    let name = points.name.clone();
    let changed = |scene: &Scene, change: fn(&mut LightKind)| {
        let mut scene = scene.clone();
        (scene.lights.iter_mut()).for_each(|light| change(&mut light.kind));
        scene
    };
    let sun = changed(&still, |kind| {
        if let LightKind::Sun { direction, .. } = kind {
            *direction = (*direction + 0.3 * DVec3::X).normalize();
        }
    });
    let sky = changed(&sun, |kind| {
        if let LightKind::Environment { scale, .. } = kind {
            *scale *= 3.0;
        }
    });
    let cup = moved(sky.clone(), &name, 0.2, 0.02 * DVec3::Y);
    let view = |renderer: &mut Renderer, scene: &Scene| {
        renderer.update(scene).unwrap();
        renderer.caustic().unwrap();
        renderer.view(&scene.camera, [96, 54], 1).unwrap();
        let picture = renderer.read_view().unwrap();
        let mut passes = renderer.take_times().into_iter();
        (
            picture,
            passes.any(|pass| pass.name == "environment points"),
        )
    };
    let mut renderer = device.renderer(&still, &footprint(256));
    let mut last = None;
    // A renderer that is made for the moved cup divides its facets otherwise for the caustic.
    let scenes = [
        (&still, true, 0.0),
        (&sun, false, 0.0),
        (&sky, true, 0.0),
        (&cup, true, 1e-5),
    ];
    for (scene, finds, bound) in scenes {
        let (picture, found) = view(&mut renderer, scene);
        assert_eq!(found, finds);
        let alone = view(&mut device.renderer(scene, &footprint(256)), scene).0;
        assert!(l1(&picture, &alone) <= bound);
        assert!(
            last.replace(bits(&picture)) != Some(bits(&picture)),
            "they differ"
        );
    }
    // Nor do points depend on how fine the maps are.
    renderer.set_direct_halvings(2);
    let sun_again = changed(&cup, |kind| {
        if let LightKind::Sun { direction, .. } = kind {
            *direction = (*direction - 0.2 * DVec3::X).normalize();
        }
    });
    assert!(!view(&mut renderer, &sun_again).1);
}

/// Pictures of coarse maps show direct light and caustics in the same places.
#[test]
fn coarse_maps_keep_light_in_its_place() {
    let device = Device::open();
    let scene = with_texels(load("ring.toml"), "floor", [511, 509]);
    let size = [320, 180];
    let view = |halvings, camera: &Camera| {
        let mut renderer = device.renderer(&scene, &footprint(16_384));
        renderer.set_direct_halvings(halvings);
        renderer.caustic().unwrap();
        renderer.view(camera, size, 1).unwrap();
        renderer.read_view().unwrap()
    };
    let fine = view(0, &scene.camera);
    // A pixel aside.
    let mut aside = scene.camera.clone();
    let width = 2.0 * (0.5 * aside.fov).tan() * aside.position.distance(aside.target);
    let forward = (aside.target - aside.position).normalize();
    aside.target += width / f64::from(size[1]) * forward.cross(DVec3::Y).normalize();
    let [error, perturbed] = [&scene.camera, &aside].map(|camera| l1(&view(2, camera), &fine));
    assert_error("picture of coarse maps", 0.01, error, perturbed);
}
