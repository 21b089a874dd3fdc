//! What the layer over Vulkan promises: limits are errors, failures can be recovered from,
//! resources stay alive, times are complete.

use crate::common::Device;
use nephroid::Error;
use nephroid::gpu::{
    BoundPipeline, Buffer, Context, Image, Recorder, Resource, Sampling, Staging, shaders,
};
use std::sync::Arc;

/// A pipeline of compact.comp over 64 pairs with one footprint each, of which only `quads` lives
/// on elsewhere.
fn compact(context: &Arc<Context>, quads: &Buffer) -> BoundPipeline {
    let buffer = |name, words| Buffer::with_data(context, name, &vec![1u32; words]).unwrap();
    let resources = [
        ("counts", Resource::Buffer(&buffer("counts", 64))),
        ("group_counts", Resource::Buffer(&buffer("groups", 2))),
        ("quads", Resource::Buffer(quads)),
        ("arguments", Resource::Buffer(&buffer("arguments", 7))),
    ];
    BoundPipeline::compute(
        context,
        &shaders::COMPACT_COMP,
        Default::default(),
        &resources,
    )
    .unwrap()
}

fn quads(context: &Arc<Context>) -> Buffer {
    Buffer::with_data(context, "quads", &[u32::MAX; 6 * 64]).unwrap()
}

/// compact.comp lists the quad of slot 2 i of pair i. Buffers that were dropped would be reused and garbled,
/// and the layers would say so.
#[test]
fn pipelines_keep_what_is_bound_to_them() {
    let device = Device::open();
    let quads = quads(&device.0);
    let pipeline = compact(&device.0, &quads);
    for _ in 0..8 {
        Buffer::with_data(&device.0, "in the way", &[7u32; 64]).unwrap();
    }
    let mut recorder = Recorder::new(&device.0).unwrap();
    recorder.dispatch(&pipeline, &[64u32, 2], [64, 1, 1]);
    recorder.submit().unwrap();
    let corners = |slot: u32| [0, 1, 2, 2, 1, 3].map(|corner| 4 * slot + corner);
    let expected: Vec<u32> = (0..64).flat_map(|pair| corners(2 * pair)).collect();
    assert_eq!(quads.read::<u32>(6 * 64).unwrap(), expected);
}

/// More groups than any device takes along y: nothing runs, and the recorder goes on.
#[test]
fn a_dispatch_beyond_the_limit_is_an_error() {
    let device = Device::open();
    let quads = quads(&device.0);
    let pipeline = compact(&device.0, &quads);
    let push = [64u32, 2]; // pairs, slots of each
    let mut recorder = Recorder::new(&device.0).unwrap();
    recorder
        .pass("too much", |r| {
            r.dispatch(&pipeline, &push, [64, 1, 1]);
            r.dispatch(&pipeline, &push, [64, u32::MAX, 1]);
        })
        .unwrap();
    let error = recorder.submit().unwrap_err();
    assert!(matches!(error, Error::Device { .. }), "{error}");
    for part in ["compact.comp", "4294967295 workgroups", "remedy"] {
        assert!(error.to_string().contains(part), "{error}");
    }
    assert_eq!(quads.read::<u32>(6 * 64).unwrap(), [u32::MAX; 6 * 64]);
    assert!(recorder.take_times().is_empty());

    recorder
        .pass("enough", |r| r.dispatch(&pipeline, &push, [64, 1, 1]))
        .unwrap();
    recorder.submit().unwrap();
    assert_eq!(quads.read::<u32>(6 * 64).unwrap()[6 * 63], 4 * 126);
    let names: Vec<_> = recorder.take_times().iter().map(|t| t.name).collect();
    assert_eq!(names, ["enough"]);
}

#[test]
fn every_pass_is_timed_however_many() {
    let device = Device::open();
    let mut recorder = Recorder::new(&device.0).unwrap();
    let mut frame = |passes: usize| {
        recorder.begin_frame().unwrap();
        for _ in 1..passes {
            recorder.pass("most", |_| {}).unwrap();
        }
        recorder.pass("last", |_| {}).unwrap();
        recorder.submit().unwrap();
    };
    frame(3);
    frame(700); // nobody takes the times of the three
    frame(600);
    let times = recorder.take_times();
    assert_eq!(times.len(), 600);
    assert!(
        times
            .iter()
            .all(|time| time.gpu.is_some_and(|s| (0.0..1.0).contains(&s)))
    );
    assert!(times[..599].iter().all(|time| time.name == "most"));
    assert_eq!(times[599].name, "last");

    // Also where they are submitted one by one.
    recorder.wait_each_pass(true);
    for _ in 0..300 {
        recorder.pass("alone", |_| {}).unwrap();
    }
    let times = recorder.take_times();
    assert_eq!(times.len(), 300);
    assert!(
        times
            .iter()
            .all(|t| t.gpu.is_some() && t.wall.is_some_and(|s| s > 0.0))
    );
    assert!(recorder.take_times().is_empty());
}

#[test]
fn an_image_beyond_the_limit_is_an_error() {
    let device = Device::open();
    let most = device.0.max_image_side();
    let image = |size| Image::new(&device.0, "strip", size, 1, Sampling::Clamp);
    image([most, 1]).unwrap();
    for size in [[most + 1, 1], [1, most + 1]] {
        let error = image(size).err().unwrap();
        assert!(matches!(error, Error::Device { .. }), "{error}");
        assert!(error.to_string().contains("strip"), "{error}");
    }
}

/// One queue, several threads: the layers report unlocked use. Command pools are made before and
/// destroyed after, for layers 1.3.239 can crash when one thread does so while others submit.
#[test]
fn threads_share_the_queue() {
    let device = Device::open();
    let mut recorders: Vec<_> = (0..4).map(|_| Recorder::new(&device.0).unwrap()).collect();
    std::thread::scope(|scope| {
        for recorder in &mut recorders {
            scope.spawn(move || {
                for _ in 0..100 {
                    recorder.pass("shared", |_| {}).unwrap();
                    recorder.submit().unwrap();
                }
            });
        }
    });
}

fn small_image(device: &Device) -> Image {
    let image = Image::new(&device.0, "small", [4, 2], 1, Sampling::Clamp).unwrap();
    let mut staging = Staging::new(&device.0, 1);
    staging.prepare(&image);
    let mut recorder = Recorder::new(&device.0).unwrap();
    staging.record(&mut recorder);
    recorder.submit().unwrap();
    image
}

#[test]
fn the_whole_of_an_image_or_buffer_can_be_read() {
    let device = Device::open();
    assert_eq!(small_image(&device).read([0, 0], [4, 2]).unwrap().len(), 8);
    let quads = quads(&device.0);
    assert_eq!(quads.read::<u32>(6 * 64).unwrap().len(), 6 * 64);
}

#[test]
#[should_panic(expected = "385 elements of 4 bytes are read from a buffer of 1536")]
fn reading_beyond_a_buffer_panics() {
    let device = Device::open();
    let _ = quads(&device.0).read::<u32>(6 * 64 + 1);
}

#[test]
#[should_panic(expected = "are read from an image")]
fn reading_beyond_an_image_panics() {
    let device = Device::open();
    let _ = small_image(&device).read([1, 0], [4, 2]);
}
