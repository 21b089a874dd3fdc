//! Writes the generated part of `assets/`: `cargo run --example generate_assets`.
//!
//! Rerunning changes no byte; `tests/suite/assets.rs` holds the checked-in files to that.

mod assets;

use std::path::Path;

fn main() -> nephroid::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    for (path, content) in assets::all() {
        nephroid::output::write_atomically(&root.join(path), &content)?;
        println!("{path}: {} bytes", content.len());
    }
    Ok(())
}
