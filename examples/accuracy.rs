//! Writes `docs/accuracy.md`: the closed forms, and how close the renderer and the reference come
//! to them on this machine. Run by `make accuracy`.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Device, accuracy, run::Run};

fn main() -> std::io::Result<()> {
    let device = Device::unwatched();
    let run = Run::on(device.0.info());
    let reached = accuracy::measure(&device, |line| println!("{line}"));
    let text = accuracy::document(&run, &reached);
    std::fs::write(accuracy::path(), &text)?;
    println!("wrote docs/accuracy.md");
    let wrong = accuracy::disagreements(&text);
    if !wrong.is_empty() {
        eprintln!("error: {}", wrong.join("\nerror: "));
        std::process::exit(1);
    }
    Ok(())
}
