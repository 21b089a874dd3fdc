//! Light maps whose sizes the renderer chooses.

use crate::common::folder::{Folder, SCENE};
use crate::common::{Device, load, only_receiver};
use nephroid::image_file::RgbImage;
use nephroid::measure::choose_light_maps;
use nephroid::render::Settings;

/// A second rect, with a size.
const CEILING: &str = r#"
[[object]]
name = "ceiling"
rect = { origin = [-2.0, 2.0, 0.0], edge_u = [4.0, 0.0, 0.0], edge_v = [0.0, 0.0, 2.0] }
material = "plaster"
lightmap = [8, 8]
"#;

/// Texels of the finer map in one of the chosen map, on each axis.
const FINER: u32 = 4;

/// L1 difference between a map, interpolated bilinearly, and one of FINER times its width and height, over the light.
fn unresolved(map: &RgbImage, finer: &RgbImage) -> f64 {
    let at = |x: i64, y: i64| {
        let x = x.clamp(0, i64::from(map.width) - 1) as usize;
        let y = y.clamp(0, i64::from(map.height) - 1) as usize;
        let rgb = map.pixels[y * map.width as usize + x];
        rgb.iter().map(|&value| f64::from(value)).sum::<f64>()
    };
    let place = |texel: u32| (f64::from(texel) + 0.5) / f64::from(FINER) - 0.5;
    let (mut difference, mut light) = (0.0, 0.0);
    for (index, rgb) in (0..).zip(&finer.pixels) {
        let [x, y] = [index % finer.width, index / finer.width].map(place);
        let [column, row] = [x, y].map(|place| place.floor() as i64);
        let [u, v] = [x - x.floor(), y - y.floor()];
        let below = (1.0 - u) * at(column, row) + u * at(column + 1, row);
        let above = (1.0 - u) * at(column, row + 1) + u * at(column + 1, row + 1);
        let value = rgb.iter().map(|&value| f64::from(value)).sum::<f64>();
        difference += (value - (1.0 - v) * below - v * above).abs();
        light += value;
    }
    difference / light
}

/// The chosen map has about the error that is asked for, against a map of four times its width.
#[test]
fn chosen_light_maps_resolve_the_caustic() {
    let device = Device::open();
    let aims = |error| Settings {
        error: Some(error),
        ..Settings::default()
    };
    for (name, target) in [("ring", 0.1), ("bumps", 0.15), ("mesh_cage", 0.15)] {
        let scene = load(&format!("{name}.toml"));
        let floor = scene.light_maps()[0].0;
        let receiver = scene.objects[floor].name.clone();
        let scene = only_receiver(scene, &receiver, [64, 64]);
        let chosen = choose_light_maps(&device.0, &scene, &[floor], &aims(target)).unwrap();
        let [found] = &chosen[..] else {
            panic!("{chosen:?}")
        };
        let baked = |texels| {
            let scene = only_receiver(scene.clone(), &receiver, texels);
            device.caustic(&scene, &receiver, &aims(0.02))
        };
        let measured = unresolved(
            &baked(found.texels),
            &baked(found.texels.map(|n| FINER * n)),
        );
        println!("{name} {target} {found:?} {measured}");
        let target = f64::from(target);
        assert!(
            (0.6 * target..1.3 * target).contains(&measured),
            "{name} {found:?} {measured}"
        );
        assert!(found.unresolved < 1.1 * target, "{name} {found:?}");
    }
}

/// A light map that gets no light is as small as can be, and sizes in the file are kept.
#[test]
fn only_light_maps_without_a_size_change() {
    let folder = Folder::new();
    // Twice as long as wide.
    let text = SCENE
        .replace("edge_v = [0.0, 0.0, -2.0]", "edge_v = [0.0, 0.0, -1.0]")
        .replace("lightmap = [32, 16]", "lightmap = \"auto\"");
    folder.write("scene.toml", text + CEILING);
    let animation = folder.load().unwrap().animation;
    let scene = animation.at(0.0);
    let [floor] = animation.auto_light_maps() else {
        panic!("one is \"auto\"")
    };
    assert_eq!(scene.objects[*floor].name, "floor");
    // Square texels, 256 on the longer side.
    assert_eq!(scene.objects[*floor].light_map, Some([256, 128]));
    assert_eq!(scene.light_maps()[1].1, [8, 8]);
    let mut dark = scene.clone();
    dark.lights.clear();
    let device = Device::open();
    let settings = Settings::default();
    let sizes = choose_light_maps(&device.0, &dark, &[*floor], &settings).unwrap();
    assert_eq!(sizes[0].texels, [32, 16]);
    assert_eq!(sizes[0].unresolved, 0.0);
}
