//! The validation layers are on and are heard: mistakes made on purpose are caught, so that their
//! silence in other tests means something.

use crate::common::Device;
use nephroid::gpu::{
    Access, BoundPipeline, Buffer, Context, Image, Recorder, Resource, Sampling, shaders,
};
use std::sync::Arc;

/// Words of a patch and more than those of a triangle, its normals and a lit triangle.
const WORDS: usize = 24;

fn buffer(context: &Arc<Context>, name: &str) -> Buffer {
    Buffer::with_data(context, name, &[0u32; WORDS]).unwrap()
}

/// A pipeline of sample.comp, which reads `triangles` and writes `patches`. It keeps the buffers
/// that nobody else holds alive.
fn sample(context: &Arc<Context>, triangles: &Buffer, patches: &Buffer) -> BoundPipeline {
    let resources = [
        ("triangles", Resource::Buffer(triangles)),
        ("normals", Resource::Buffer(&buffer(context, "normals"))),
        (
            "lit_triangles",
            Resource::Buffer(&buffer(context, "lit triangles")),
        ),
        ("patches", Resource::Buffer(patches)),
    ];
    BoundPipeline::compute(
        context,
        &shaders::SAMPLE_COMP,
        Default::default(),
        &resources,
    )
    .unwrap()
}

/// What the layers say of `mistake`, up to the end of all that it makes.
fn messages(mistake: impl FnOnce(&Arc<Context>)) -> Vec<String> {
    let device = Device::open();
    mistake(&device.0);
    device.0.messages().take()
}

fn write_then_read(context: &Arc<Context>, with_barrier: bool) {
    let [first, second, third] = ["first", "second", "third"].map(|name| buffer(context, name));
    let write = sample(context, &first, &second);
    let read = sample(context, &second, &third);
    let mut recorder = Recorder::new(context).unwrap();
    let push = [0u32, 1, 1]; // first patch, patches, lit triangles
    recorder.dispatch(&write, &push, [1, 1, 1]);
    if with_barrier {
        recorder.barrier(Access::COMPUTE_WRITE, Access::COMPUTE_READ);
    }
    recorder.dispatch(&read, &push, [1, 1, 1]);
    recorder.submit().unwrap();
}

#[test]
fn a_missing_barrier_is_caught() {
    let missing = messages(|context| write_then_read(context, false));
    assert!(
        missing
            .iter()
            .any(|m| m.contains("SYNC-HAZARD-READ-AFTER-WRITE")),
        "{missing:?}"
    );
    let in_order = messages(|context| write_then_read(context, true));
    assert_eq!(in_order, Vec::<String>::new());
}

/// GPU-assisted validation. Layers 1.3.239 check loads and stores of numbers and vectors, not of
/// whole structs, so compact.comp is misused here: it reads one number a pair.
#[test]
fn reading_beyond_a_buffer_is_caught() {
    let read = |pairs: u32| {
        messages(|context| {
            let four_counts = Buffer::with_data(context, "four counts", &[0u32; 4]).unwrap();
            let resources = [
                ("counts", Resource::Buffer(&four_counts)),
                ("group_counts", Resource::Buffer(&buffer(context, "groups"))),
                ("quads", Resource::Buffer(&buffer(context, "quads"))),
                ("arguments", Resource::Buffer(&buffer(context, "arguments"))),
            ];
            let pipeline = BoundPipeline::compute(
                context,
                &shaders::COMPACT_COMP,
                Default::default(),
                &resources,
            )
            .unwrap();
            let mut recorder = Recorder::new(context).unwrap();
            recorder.dispatch(&pipeline, &[pairs, 2], [1, 1, 1]);
            recorder.submit().unwrap();
        })
    };
    let beyond = read(5);
    assert!(
        beyond.iter().any(|m| m.contains("out of bounds")),
        "{beyond:?}"
    );
    assert_eq!(read(4), Vec::<String>::new());
}

/// Core validation: 4×4 texels have three levels.
#[test]
fn an_image_of_too_many_levels_is_caught() {
    let with_levels = |levels| {
        messages(|context| {
            Image::new(context, "small", [4, 4], levels, Sampling::Clamp).unwrap();
        })
    };
    let too_many = with_levels(4);
    assert!(
        too_many
            .iter()
            .any(|m| m.contains("VUID-VkImageCreateInfo-mipLevels")),
        "{too_many:?}"
    );
    assert_eq!(with_levels(3), Vec::<String>::new());
}

#[test]
#[should_panic(expected = "SYNC-HAZARD")]
fn the_guard_of_the_other_tests_fails_on_a_message() {
    let device = Device::open();
    write_then_read(&device.0, false);
}
