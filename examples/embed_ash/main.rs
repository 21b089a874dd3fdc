//! A host application with a Vulkan device of its own draws a floor with the caustic of a spinning ring, two frames
//! in flight, and writes the last picture: `cargo run --release --example embed_ash -- floor.png`.

mod host;

use nephroid::render::Settings;
use std::error::Error;

const FRAMES: u32 = 120;
const SIZE: [u32; 2] = [960, 540];

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).unwrap_or("embed_ash.png".into());
    let scene = host::scene()?;
    let rendered = host::render(&scene, &Settings::default(), SIZE, FRAMES, false)?;
    image::save_buffer(
        &file,
        &rendered.picture,
        SIZE[0],
        SIZE[1],
        image::ColorType::Rgba8,
    )?;
    let [median, longest] = rendered.record_seconds.map(|seconds| 1e3 * seconds);
    println!(
        "{FRAMES} frames; recording the caustic took {median:.2} ms of the host's time a frame, at most {longest:.2} ms"
    );
    println!("wrote {file}");
    Ok(())
}
