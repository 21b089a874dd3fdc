//! A headless program that uses wgpu shares its Vulkan device with nephroid. nephroid records into command buffers of
//! wgpu, and wgpu samples nephroid's light map without a copy. The program writes the last of 120 frames:
//! `cargo run --release --manifest-path examples/embed_wgpu/Cargo.toml -- floor.png`.
//!
//! With `--check MAP.exr`, the program runs under the validation layers. It fails if they report anything, or if the
//! floor's light map in the first frame differs in any bit from `MAP.exr`, which `nephroid bake --samples 16384` writes.

mod host;
mod view;

use host::Host;
use nephroid::ash::vk;
use nephroid::glam::{DMat3, DVec3};
use nephroid::gpu::Context;
use nephroid::image_file::{RgbImage, read_rgb};
use nephroid::render::{Frame, MapImage, ReceiverTile, Renderer, Settings};
use nephroid::scene::{Scene, Similarity};
use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use view::View;
use wgpu::hal::api::Vulkan;

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/scenes/ring.toml");
const FRAMES: u32 = 120;
const FRAMES_IN_FLIGHT: usize = 2;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Number of warnings and errors so far, except those about performance. wgpu-hal logs the validation layers' messages.
static MESSAGES: AtomicUsize = AtomicUsize::new(0);

struct Log;

impl log::Log for Log {
    fn enabled(&self, _: &log::Metadata) -> bool {
        true // up to the level that `main` sets
    }

    fn log(&self, record: &log::Record) {
        let text = record.args().to_string();
        // Lines that begin with a tab add details to the message before them.
        if !text.starts_with("PERFORMANCE ") && !text.starts_with('\t') {
            eprintln!("{} {}: {text}", record.level(), record.target());
            MESSAGES.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn flush(&self) {}
}

fn main() {
    // Set before the instance is created: wgpu-hal asks the layers only for messages of levels that are logged.
    log::set_logger(&Log).expect("the only logger");
    log::set_max_level(log::LevelFilter::Warn);
    if let Err(error) = run() {
        eprintln!("error: {error}");
        std::process::exit(1);
    }
}

fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (png, baked) = match &arguments[..] {
        [png] => (png, None),
        [png, check, map] if check == "--check" => (png, Some(read_rgb(Path::new(map))?)),
        _ => return Err("usage: embed_wgpu PICTURE.png [--check MAP.exr]".into()),
    };
    render(Path::new(png), baked.as_ref())?;
    println!("wrote {png}");
    // Counted after all objects are destroyed, because the layers report leaks then.
    match MESSAGES.load(Ordering::Relaxed) {
        count if count > 0 && baked.is_some() => Err(format!("{count} messages, see above").into()),
        _ => Ok(()),
    }
}

fn render(png: &Path, baked: Option<&RgbImage>) -> Result<()> {
    let still = nephroid::scene::load(Path::new(SCENE))?.scene;
    let (host, external) = host::open(baked.is_some())?;
    // SAFETY: `host::open` created the device as `external` describes it, and `host` is dropped last.
    let context = unsafe { Context::from_raw(external) }?;
    let settings = Settings {
        frames_in_flight: FRAMES_IN_FLIGHT as u32,
        ..Settings::default()
    };
    let mut renderer = Renderer::new(&context, &still, &settings)?;
    let rendered = render_frames(&host, &mut renderer, &still, png, baked);
    // The renderer owns the image, so the device must be idle and wgpu's texture destroyed before it is dropped.
    host.device.poll(wgpu::PollType::wait_indefinitely())?;
    rendered
}

fn render_frames(
    host: &Host,
    renderer: &mut Renderer,
    still: &Scene,
    png: &Path,
    baked: Option<&RgbImage>,
) -> Result<()> {
    // The first frame moves the image from layout UNDEFINED to GENERAL. wgpu must be told the layout of the image, so
    // the image becomes a texture only after that frame is submitted.
    let (commands, light_map, tile) = record(host, renderer, still)?;
    let mut in_flight = VecDeque::from([host.queue.submit([commands])]);
    // SAFETY: the first frame leaves the image in layout GENERAL. `render` keeps the renderer until wgpu is done.
    let light_map = unsafe { view::wrap(host, light_map) };
    if let Some(baked) = baked {
        compare(host, &light_map, &tile, baked)?;
    }

    let view = View::new(host, &light_map, &tile);
    for frame in 1..FRAMES {
        if in_flight.len() == FRAMES_IN_FLIGHT {
            host.device.poll(wgpu::PollType::Wait {
                submission_index: in_flight.pop_front(),
                timeout: None,
            })?;
        }
        // nephroid expects the light map in layout GENERAL and leaves it in that layout. This transition changes the
        // layout, and wgpu remembers it for its next barrier.
        let mut before = host.device.create_command_encoder(&Default::default());
        let to_general = wgpu::TextureTransition {
            texture: &light_map,
            selector: None,
            state: view::GENERAL,
        };
        before.transition_resources([].into_iter(), [to_general].into_iter());
        let (commands, ..) = record(host, renderer, &scene_at(still, frame))?;
        let mut after = host.device.create_command_encoder(&Default::default());
        view.draw(&mut after);
        let submitted = (host.queue).submit([before.finish(), commands, after.finish()]);
        in_flight.push_back(submitted);
    }
    let picture = view::read(host, &view.picture, [0, 0], view::PICTURE)?;
    let [width, height] = view::PICTURE;
    image::save_buffer(png, &picture, width, height, image::ColorType::Rgba8)?;
    Ok(())
}

/// Frame 0 is the scene of the file. In later frames, the ring rises and spins like a coin on a table.
fn scene_at(still: &Scene, frame: u32) -> Scene {
    let mut scene = still.clone();
    let ring = scene.object_index("ring").expect("the scene has a ring");
    let risen = f64::from(frame) / f64::from(FRAMES - 1);
    let angle = f64::from(frame) * 3f64.to_radians();
    let spin = Similarity {
        scale: 1.0,
        rotation: DMat3::from_rotation_y(angle) * DMat3::from_rotation_x(0.3 * risen),
        shift: DVec3::new(0.0, 0.25 * risen, 0.0),
    };
    scene.objects[ring].geometry = scene.objects[ring].geometry.moved(&spin);
    scene
}

/// Records a frame of nephroid into a command buffer of wgpu. Also returns the light map and the floor's tile of it.
fn record(
    host: &Host,
    renderer: &mut Renderer,
    scene: &Scene,
) -> Result<(wgpu::CommandBuffer, MapImage, ReceiverTile)> {
    let direct = false;
    let frame = Frame {
        scene,
        direct,
        view: None,
    };
    // An encoder of its own: wgpu panics if an encoder has both raw commands and commands of wgpu.
    let mut encoder = host.device.create_command_encoder(&Default::default());
    // SAFETY: the encoder is recording, outside of a render pass. The caller submits it once and in order, and has
    // waited for the frame that came two frames earlier.
    let (light_map, tile) = unsafe {
        encoder.as_hal_mut::<Vulkan, _, Result<_>>(|hal| {
            let commands = hal.ok_or("the encoder is not of Vulkan")?.raw_handle();
            let output = renderer.record(commands, &frame)?;
            // wgpu's next barrier waits only for shaders, but nephroid also writes the light map by blending. After
            // this barrier, every later stage waits for all of nephroid's writes.
            let barriers = [vk::MemoryBarrier2::default()
                .src_stage_mask(output.last_stage)
                .src_access_mask(output.last_access)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)];
            let dependency = vk::DependencyInfo::default().memory_barriers(&barriers);
            host.vulkan.cmd_pipeline_barrier2(commands, &dependency);
            let floor = scene.object_index("floor");
            let tile = (output.receivers.iter()).find(|tile| Some(tile.object) == floor);
            Ok((output.light_map, *tile.ok_or("the floor has no light map")?))
        })?
    };
    Ok((encoder.finish(), light_map, tile))
}

/// Fails unless the floor's light map equals `baked` bit for bit.
fn compare(
    host: &Host,
    light_map: &wgpu::Texture,
    tile: &ReceiverTile,
    baked: &RgbImage,
) -> Result<()> {
    let [width, height] = tile.light.size;
    if [baked.width, baked.height] != tile.light.size {
        return Err(format!("the baked map must have {width} x {height} texels").into());
    }
    let bytes = view::read(host, light_map, tile.light.origin, tile.light.size)?;
    // The texture has RGBA, the file RGB.
    let texels = bytes.chunks_exact(16).map(|rgba| &rgba[..12]);
    let differ = (texels.zip(&baked.pixels))
        .filter(|(texel, pixel)| *texel != pixel.map(f32::to_le_bytes).as_flattened())
        .count();
    if differ > 0 {
        let all = width * height;
        return Err(format!("{differ} of {all} texels differ from the baked map's").into());
    }
    println!("the floor's {width} x {height} texels are those of the baked map, bit for bit");
    Ok(())
}
