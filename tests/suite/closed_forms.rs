//! The renderer and the reference against closed forms, and the document that says so.

use crate::common::closed_forms::{
    BALL, CARDIOID, DISH, Form, IMAGE, LAMP, MIRROR, NEPHROID, Perturbation, RIM, Solver, Twin,
    cases,
};
use crate::common::glass::{BALL_LENS, PLATE, PRISM, RAINBOW, STIGMATIC};
use crate::common::{
    Device, accuracy, assert_error, assert_physical, flux, load, method, rect, tinted,
};
use nephroid::image_file::RgbImage;
use nephroid::render::{Method, Settings};

/// Every figure of the form's cases is within what is asked of it and, on the device of the document, what that says, and is not
/// in its twins.
fn check(form: &Form, by_reference: bool) {
    let cases: Vec<_> = cases()
        .filter(|case| std::ptr::eq(case.form, form))
        .filter(|case| matches!(case.solver, Solver::Reference(_)) == by_reference)
        .collect();
    assert!(!cases.is_empty());
    let document = std::fs::read_to_string(accuracy::path()).unwrap();
    let device = Device::open();
    let is_documented = by_reference || accuracy::is_measured_on(&document, device.0.info());
    for case in cases {
        let scene = (case.scene)();
        let map = case.map(scene.clone(), &device);
        // Figures share scenes of twins.
        let mut twins: Vec<(Perturbation, RgbImage)> = Vec::new();
        assert_physical(&map);
        for asked in case.asked {
            let what = [form.title, case.scene_text, asked.figure.name].join(", ");
            let error = (asked.figure.error)(&scene, &map);
            if is_documented {
                accuracy::assert_documented(&document, case, asked, error);
            }
            assert!(!asked.twins.is_empty());
            for &twin in asked.twins {
                let perturbed = match twin {
                    Twin::Under(factor) => tinted(&map, factor),
                    Twin::Of(of) => {
                        let known = (twins.iter())
                            .position(|(known, _)| std::ptr::fn_addr_eq(*known, of))
                            .unwrap_or(twins.len());
                        if known == twins.len() {
                            twins.push((of, case.map(of(scene.clone()), &device)));
                        }
                        twins[known].1.clone()
                    }
                };
                let perturbed = (asked.figure.error)(&scene, &perturbed);
                assert_error(&what, asked.bound, error, perturbed);
            }
        }
    }
}

#[test]
fn footprints_have_their_ridge_on_the_nephroid() {
    check(&NEPHROID, false);
}

#[test]
fn reference_has_its_ridge_on_the_nephroid() {
    check(&NEPHROID, true);
}

#[test]
fn dish_lights_a_screen_before_and_in_its_focus() {
    check(&DISH, false);
}

#[test]
fn dish_by_reference() {
    check(&DISH, true);
}

#[test]
fn flat_mirror_casts_its_exact_image() {
    check(&MIRROR, false);
}

#[test]
fn flat_mirror_by_reference() {
    check(&MIRROR, true);
}

#[test]
fn flat_mirror_shows_the_image_of_a_lamp() {
    check(&IMAGE, false);
}

#[test]
fn image_of_a_lamp_by_reference() {
    check(&IMAGE, true);
}

#[test]
fn footprints_have_their_ridge_on_the_cardioid() {
    check(&CARDIOID, false);
}

#[test]
fn reference_has_its_ridge_on_the_cardioid() {
    check(&CARDIOID, true);
}

#[test]
fn ball_in_constant_radiance_by_pinhole() {
    check(&BALL, false);
}

#[test]
fn ball_in_constant_radiance_by_reference() {
    check(&BALL, true);
}

#[test]
fn lamp_of_an_environment_by_reference() {
    check(&LAMP, true);
}

#[test]
fn ring_keeps_light_from_its_floor_by_reference() {
    check(&RIM, true);
}

#[test]
fn plate_of_glass_dims_and_shifts_light() {
    check(&PLATE, false);
}

#[test]
fn plate_of_glass_by_reference() {
    check(&PLATE, true);
}

#[test]
fn prism_has_its_least_deviation() {
    check(&PRISM, false);
}

#[test]
fn prism_by_reference() {
    check(&PRISM, true);
}

#[test]
fn ball_lens_has_its_focus() {
    check(&BALL_LENS, false);
}

#[test]
fn ball_lens_by_reference() {
    check(&BALL_LENS, true);
}

#[test]
fn stigmatic_lenses_gather_light_in_a_point() {
    check(&STIGMATIC, false);
}

#[test]
fn stigmatic_lenses_by_reference() {
    check(&STIGMATIC, true);
}

#[test]
fn drop_of_water_shows_the_rainbow() {
    check(&RAINBOW, false);
}

/// The committed document names all cases and what is asked, and its figures are within that.
#[test]
fn document_says_what_the_code_does() {
    let text = std::fs::read_to_string(accuracy::path()).unwrap();
    let wrong = accuracy::disagreements(&text);
    assert!(wrong.is_empty(), "run make accuracy: {wrong:#?}");

    let row = (text.lines())
        .find(|line| line.contains("`footprint"))
        .unwrap();
    let cells: Vec<&str> = row.split(" | ").collect();
    let [asked, reached] = [cells[4], cells[5]];
    let without_device: Vec<&str> = (text.lines())
        .filter(|line| !line.starts_with("| Device"))
        .collect();
    for twin in [
        text.replacen(row, "", 1),
        text.replacen(&format!("{row}\n"), "", 1),
        text.replacen(row, &format!("{row}\n{row}"), 1),
        text.replacen(asked, &format!("1{asked}"), 1),
        text.replacen(reached, &format!("9{reached}"), 1),
        text.replacen(reached, "NaN |", 1),
        text.replacen("(1 − u)³", "(1 − u)²", 1),
        text.replacen(NEPHROID.source, "somewhere", 1),
        without_device.join("\n"),
        format!("{text}\nMore.\n"),
        String::new(),
    ] {
        assert_ne!(twin, text);
        assert!(!accuracy::disagreements(&twin).is_empty(), "{twin}");
    }
}

/// d² + ε instead of d² takes light away, the more the larger ε is.
#[test]
fn epsilon_lowers_the_energy() {
    let device = Device::open();
    let scene = crate::common::only_receiver(load("ball.toml"), "floor", [32, 32]);
    let floor = rect(&scene, "floor");
    let energy = |epsilon| {
        let settings = Settings {
            epsilon,
            ..method(Method::Pinhole, 1)
        };
        flux(&device.caustic(&scene, "floor", &settings), &floor)[0]
    };
    let [none, one, many] = [0.0, 1.0, 100.0].map(energy);
    println!("energy with epsilon 0, 1, 100: {none} {one} {many}");
    assert!(one < 0.9999 * none && one > 0.98 * none);
    assert!(many < 0.99 * one);
}
