//! What the scene loader takes and refuses.

use nephroid::scene::{Geometry, load};
use std::path::Path;

#[test]
fn shipped_scenes_load_without_a_warning() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    for entry in folder.read_dir().unwrap() {
        let path = entry.unwrap().path();
        let loaded = load(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
        for object in &loaded.scene.objects {
            if let Geometry::Mesh(mesh) = &object.geometry {
                println!(
                    "{} {} {}",
                    object.name,
                    mesh.positions.len(),
                    mesh.triangles.len()
                );
            }
        }
    }
}
