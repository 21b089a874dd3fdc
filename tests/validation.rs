//! The validation layers are on and are heard: mistakes made on purpose are caught, so that their
//! silence in other tests means something.

mod common;

use common::{Device, validated_context};
use nephroid::gpu::{Access, Buffer, Context, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

/// Words of a patch and more than those of a triangle, its normals and a reflector.
const WORDS: usize = 24;

fn buffer(context: &Arc<Context>, name: &str) -> Buffer {
    Buffer::with_data(context, name, &[0u32; WORDS]).unwrap()
}

/// A pipeline of sample.comp, which reads `triangles` and writes `patches`.
fn sample(context: &Arc<Context>, triangles: &Buffer, patches: &Buffer) -> (Pipeline, [Buffer; 2]) {
    let others = [buffer(context, "normals"), buffer(context, "reflectors")];
    let resources = [
        ("triangles", Resource::Buffer(triangles)),
        ("normals", Resource::Buffer(&others[0])),
        ("reflectors", Resource::Buffer(&others[1])),
        ("patches", Resource::Buffer(patches)),
    ];
    let pipeline = Pipeline::compute(context, &shaders::SAMPLE_COMP, &resources).unwrap();
    (pipeline, others)
}

/// What the layers say of `mistake`.
fn messages(mistake: impl FnOnce(&Arc<Context>)) -> Vec<String> {
    let context = validated_context();
    mistake(&context);
    context.validation_messages()
}

fn write_then_read(context: &Arc<Context>, with_barrier: bool) {
    let [first, second, third] = ["first", "second", "third"].map(|name| buffer(context, name));
    let (write, _others) = sample(context, &first, &second);
    let (read, _more) = sample(context, &second, &third);
    let mut recorder = Recorder::new(context).unwrap();
    let push = [0u32, 1, 1]; // first patch, patches, reflectors
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
            let others = ["groups", "order", "arguments"].map(|name| buffer(context, name));
            let resources = [
                ("counts", Resource::Buffer(&four_counts)),
                ("group_counts", Resource::Buffer(&others[0])),
                ("order", Resource::Buffer(&others[1])),
                ("arguments", Resource::Buffer(&others[2])),
            ];
            let pipeline = Pipeline::compute(context, &shaders::COMPACT_COMP, &resources).unwrap();
            let mut recorder = Recorder::new(context).unwrap();
            recorder.dispatch(&pipeline, &[pairs, 1], [1, 1, 1]);
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

/// Core validation: more groups than any device must take along y (65 535 on lavapipe).
#[test]
fn too_large_a_dispatch_is_caught() {
    let dispatch = |groups| {
        messages(|context| {
            let [triangles, patches] = ["triangles", "patches"].map(|name| buffer(context, name));
            let (pipeline, _others) = sample(context, &triangles, &patches);
            let mut recorder = Recorder::new(context).unwrap();
            recorder.dispatch(&pipeline, &[0u32, 0, 1], [0, groups, 1]);
            recorder.submit().unwrap();
        })
    };
    let too_many = dispatch(u32::MAX);
    assert!(
        too_many
            .iter()
            .any(|m| m.contains("VUID-vkCmdDispatch-groupCountY")),
        "{too_many:?}"
    );
    assert_eq!(dispatch(1), Vec::<String>::new());
}

#[test]
#[should_panic(expected = "SYNC-HAZARD")]
fn the_guard_of_the_other_tests_fails_on_a_message() {
    let device = Device::open();
    write_then_read(&device.0, false);
}
