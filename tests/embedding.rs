//! A host application with its own device: the frames that it records are those of the blocking calls, bit for bit.

#![cfg(feature = "cli")]

mod common;
#[path = "../examples/embed_ash/host.rs"]
mod host;

use ash::vk;
use common::{footprint, only_receiver};
use nephroid::Error;
use nephroid::glam::DVec3;
use nephroid::gpu::{Context, External};
use nephroid::measure::Spread;
use nephroid::optics::reflect;
use nephroid::render::{Frame, Renderer, ViewFrame};
use nephroid::scene::{Geometry, LightKind, Scene};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Held by each test: the layers' map of devices has no lock ([`common::Device::open`]), and these tests make devices of hosts.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// 120 frames of a spinning ring, two in flight, under all checks of the validation layers.
#[test]
fn a_host_gets_the_bits_of_the_blocking_calls() {
    let _alone = alone();
    const FRAMES: u32 = 120;
    // A simple ring on a floor with few texels, without walls, whose direct light has many: the checks make shaders slow.
    let mut still = common::with_texels(host::scene().unwrap(), "floor", [64, 64]);
    still
        .objects
        .retain(|object| !object.name.starts_with("wall"));
    common::object_mut(&mut still, "ring").geometry =
        Geometry::Mesh(common::hollow_cylinder(1.0, 0.6, 64).into());
    let settings = footprint(1024);
    let rendered = host::render(&still, &settings, [160, 90], FRAMES, true).unwrap();
    assert_eq!(rendered.messages, Vec::<String>::new());
    let colours = rendered.picture.chunks(4).map(|pixel| pixel[0]);
    assert!(colours.clone().max() > Some(200) && colours.min() < Some(50));

    let device = common::Device::open();
    let mut renderer = device.renderer(&host::scene_at(&still, 0), &settings);
    for frame in 1..FRAMES {
        renderer.update(&host::scene_at(&still, frame)).unwrap();
    }
    renderer.caustic().unwrap();
    let floor = still.object_index("floor").unwrap();
    let blocking = renderer.read_caustic(floor).unwrap();
    let bits = |rgb: &[f32; 3]| rgb.map(f32::to_bits);
    // The floor's tile is at the left edge, beside its coarser levels.
    let row = rendered.light_map.len() / blocking.height as usize;
    let mut lit = 0;
    for (index, pixel) in blocking.pixels.iter().enumerate() {
        let (x, y) = (
            index % blocking.width as usize,
            index / blocking.width as usize,
        );
        let [r, g, b, _] = rendered.light_map[y * row + x];
        assert_eq!(bits(&[r, g, b]), bits(pixel), "texel {x}, {y}");
        lit += usize::from(*pixel != [0.0; 3]);
    }
    assert!(lit > blocking.pixels.len() / 10);
}

/// What a device lacks is named.
#[test]
fn an_unsuitable_device_of_a_host_is_refused() {
    let _alone = alone();
    host::with_external(|external| {
        let refused = |change: &dyn Fn(&mut External), part: &str| {
            let mut external = external();
            change(&mut external);
            // SAFETY: nothing is made with what is refused.
            let error = unsafe { Context::from_raw(external) }.err().unwrap();
            assert!(matches!(error, Error::Host { .. }), "{error}");
            assert!(error.to_string().contains(part), "{error}");
        };
        refused(
            &|external| external.features.synchronization2 = vk::FALSE,
            "made without the feature synchronization2",
        );
        refused(
            &|external| external.features.dynamic_rendering = vk::FALSE,
            "made without the feature dynamicRendering",
        );
        refused(
            &|external| external.features.maintenance4 = vk::FALSE,
            "made without the feature maintenance4",
        );
        refused(
            &|external| external.api_version = vk::API_VERSION_1_2,
            "made for Vulkan 1.2",
        );
        refused(&|external| external.queue_family = 99, "no queue family 99");
    });
}

/// Blocking calls and command buffers that are none, on the device of a host; scenes that change kind.
#[test]
fn a_frame_that_cannot_be_recorded_is_refused_before_it_is_begun() {
    let _alone = alone();
    let scene = only_receiver(common::load("mirror.toml"), "floor", [32, 32]);
    host::with_external(|external| {
        // SAFETY: the host outlives the context.
        let context = unsafe { Context::from_raw(external()) }.unwrap();
        let mut renderer = Renderer::new(&context, &scene, &footprint(64)).unwrap();
        for error in [
            renderer.caustic().unwrap_err(),
            renderer.direct().unwrap_err(),
            renderer.view(&scene.camera, [8, 8], 1).unwrap_err(),
            renderer.read_caustic(0).unwrap_err(),
        ] {
            assert!(
                matches!(error, Error::Host { .. } | Error::Usage { .. }),
                "{error}"
            );
        }
        let frame = |scene| Frame {
            scene,
            direct: false,
            view: None,
        };
        // SAFETY: nothing is recorded.
        let error = unsafe { renderer.record(vk::CommandBuffer::null(), &frame(&scene)) };
        assert!(matches!(error, Err(Error::Host { .. })));
        let mut other: Scene = scene.clone();
        other.lights.clear();
        // SAFETY: as above: the scene is looked at first.
        let error = unsafe { renderer.record(vk::Handle::from_raw(1), &frame(&other)) };
        let text = error.err().unwrap().to_string();
        assert!(text.contains("it had 1 lights and has 0"), "{text}");
    });
    // Nor does a device of ours record for a host.
    let device = common::Device::open();
    let mut renderer = device.renderer(&scene, &footprint(64));
    let frame = Frame {
        scene: &scene,
        direct: false,
        view: None,
    };
    // SAFETY: as above.
    let error = unsafe { renderer.record(vk::CommandBuffer::null(), &frame) };
    assert!(matches!(error, Err(Error::Host { .. })));
}

/// The light that a point low on a mirror reflects is where the tile's transform says, and not the other way up.
#[test]
fn the_transform_of_a_tile_finds_the_light() {
    let _alone = alone();
    let scene = only_receiver(common::load("mirror.toml"), "floor", [64, 64]);
    let [mirror, floor] = ["mirror", "floor"].map(|name| common::rect(&scene, name));
    let low = mirror.origin + 0.5 * mirror.edge_u + 0.05 * mirror.edge_v;
    let direction = reflect(-common::toward_sun(&scene), mirror.normal());
    let distance = (floor.origin - low).dot(floor.normal()) / direction.dot(floor.normal());
    let from_corner = low + distance * direction - floor.origin;
    let along = |edge: glam::DVec3| from_corner.dot(edge) / edge.length_squared();
    let uv = [along(floor.edge_u), along(floor.edge_v)];
    let map = common::Device::open().caustic(&scene, "floor", &footprint(1024));
    host::with_commands(|external, commands| {
        // SAFETY: the host outlives the context, and the commands are never submitted.
        let context = unsafe { Context::from_raw(external) }.unwrap();
        let mut renderer = Renderer::new(&context, &scene, &footprint(1024)).unwrap();
        let frame = Frame {
            scene: &scene,
            direct: false,
            view: None,
        };
        // SAFETY: as above.
        let output = unsafe { renderer.record(commands, &frame) }.unwrap();
        let tile = output.receivers[0];
        let lit = |uv: [f64; 2]| {
            let texel = [0, 1].map(|axis| {
                let place = uv[axis] as f32 * tile.light.scale[axis] + tile.light.offset[axis];
                let texel = place * output.light_map.size[axis] as f32;
                texel as u32 - tile.light.origin[axis]
            });
            map.pixels[(texel[1] * map.width + texel[0]) as usize] != [0.0; 3]
        };
        assert!(lit(uv), "{uv:?}");
        assert!(
            !lit([uv[0], 1.0 - uv[1]]) || !lit([1.0 - uv[0], uv[1]]),
            "{uv:?}"
        );
    });
}

/// Counts what a thread allocates while it counts.
struct Counting;

thread_local! {
    static COUNT: Cell<Option<usize>> = const { Cell::new(None) };
}

// SAFETY: the system's allocator does the work.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get().map(|count| count + 1)));
        // SAFETY: the caller's promise.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Of a scene that stands still, with lights and an environment, receivers of both kinds, direct light, and chains.
#[test]
fn recording_a_still_scene_allocates_nothing() {
    let _alone = alone();
    for name in ["globe.toml", "pool_sky.toml", "tumbler.toml"] {
        let scene = common::load_with_chains(name);
        host::with_commands(|external, commands| {
            // SAFETY: the host outlives the context.
            let context = unsafe { Context::from_raw(external) }.unwrap();
            let mut renderer = Renderer::new(&context, &scene, &footprint(256)).unwrap();
            let frame = Frame {
                scene: &scene,
                direct: true,
                view: Some(ViewFrame {
                    size: [64, 36],
                    antialias: 2,
                }),
            };
            let mut record = || {
                renderer.invalidate();
                COUNT.set(Some(0));
                // SAFETY: recording; never submitted.
                unsafe { renderer.record(commands, &frame) }.unwrap();
                COUNT.take().unwrap()
            };
            let counts = [record(), record(), record(), record()];
            assert_eq!(counts[2..], [0, 0], "{name}: {counts:?}");
            let times: Vec<f64> = (0..200)
                .map(|_| {
                    let start = Instant::now();
                    record();
                    1e3 * start.elapsed().as_secs_f64()
                })
                .collect();
            let Spread { median, p95, .. } = Spread::of(&times);
            println!("{name}: recording takes {median:.3} ms, 95 % at most {p95:.3}");
        });
    }
}

/// Parts of a frame are recorded again where their commands differ, and only there.
#[test]
fn commands_that_frames_have_in_common_are_reused() {
    let _alone = alone();
    let still = common::load("ring.toml");
    host::with_commands(|external, commands| {
        // SAFETY: the host outlives the context.
        let context = unsafe { Context::from_raw(external) }.unwrap();
        let mut renderer = Renderer::new(&context, &still, &footprint(256)).unwrap();
        let record = |renderer: &mut Renderer, scene: &Scene, size| {
            let frame = Frame {
                scene,
                direct: true,
                view: Some(ViewFrame { size, antialias: 1 }),
            };
            // SAFETY: recording; never submitted.
            unsafe { renderer.record(commands, &frame) }.unwrap();
            renderer.reused_parts()
        };
        let mut recorded = |scene: &Scene, size| {
            renderer.invalidate();
            record(&mut renderer, scene, size)
        };
        let mut scene = still.clone();
        assert_eq!([0; 3].map(|_| recorded(&scene, [64, 36])), [0, 4, 4]);
        let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind else {
            panic!("a sun");
        };
        *direction = (*direction + 0.1 * DVec3::X).normalize();
        assert_eq!(recorded(&scene, [64, 36]), 4, "other data");
        scene.camera.position += DVec3::X;
        assert_eq!(
            [0; 2].map(|_| recorded(&scene, [64, 36])),
            [3, 4],
            "another camera"
        );
        assert_eq!(
            [0; 2].map(|_| recorded(&scene, [80, 36])),
            [3, 4],
            "another picture"
        );
        renderer.time_passes(true);
        renderer.invalidate();
        assert_eq!(record(&mut renderer, &scene, [80, 36]), 0, "times");
        renderer.time_passes(false);
        renderer.invalidate();
        assert_eq!(record(&mut renderer, &scene, [80, 36]), 4);
        assert_eq!(record(&mut renderer, &scene, [80, 36]), 1, "a view only");
    });
}
