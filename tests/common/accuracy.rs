//! `docs/accuracy.md`: the closed forms with the figures that were reached.

use super::Device;
use super::closed_forms::{Asked, Case, Form, Solver, Unit, cases};
use super::run::Run;
use nephroid::gpu::DeviceInfo;
use nephroid::render::{Method, Settings};
use std::path::{Path, PathBuf};

const OPENING: &str = "# Accuracy against closed forms

Light maps whose exact values are known, computed by the renderer and by the reference on the CPU.
`make accuracy` writes this file. The tests hold the same figures to the bounds in the column
*asked*, see that a slightly wrong scene breaks them, and see that this file says what the code does.

L1 is Σ|E − E*| / ΣE*, *energy* the largest error of the flux in R, G and B, relative. Texels are
averages over their areas. The reference has noise, of about the error that it is asked for.

Camera views are compared with path tracing in [views.md](views.md).
";

const CLOSING: &str = "
## Without a test

- Water of η = a cos kx, which focuses at the depth 1/(a k² (1 − 1/n)): `tests/suite/water.rs`.
- The irradiance from the curvatures of the wavefront, E₀ cos θ / |(1 + tκ₁)(1 + tκ₂)|, in general:
  only as the paraboloid above.
- The peak at a fold, which grows as blur^(−1/2).
";

pub fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/accuracy.md")
}

/// All figures, in the order of the cases.
pub fn measure(device: &Device, mut progress: impl FnMut(&str)) -> Vec<String> {
    let mut reached = Vec::new();
    for case in cases() {
        let scene = (case.scene)();
        let map = case.map(scene.clone(), device);
        for asked in case.asked {
            let error = (asked.figure.error)(&scene, &map);
            let what = [case.form.title, &solver(case), asked.figure.name].join(", ");
            let error = value(error, asked.figure.unit);
            progress(&format!("{what}: {error}"));
            reached.push(error);
        }
    }
    reached
}

/// The document with these figures, one for each that is asked.
pub fn document(run: &Run, reached: &[String]) -> String {
    let mut text = OPENING.to_owned();
    text += "\n| | |\n|---|---|\n";
    for (name, value) in run.rows() {
        text += &format!("| {name} | {value} |\n");
    }
    let mut reached = reached.iter();
    let mut form: Option<&Form> = None;
    for case in cases() {
        if form.is_none_or(|form| !std::ptr::eq(form, case.form)) {
            form = Some(case.form);
            text += &heading(case.form);
        }
        for asked in case.asked {
            let reached = reached.next().map_or("", String::as_str);
            text += &format!("{}{reached} |\n", row(case, asked));
        }
    }
    text + CLOSING
}

/// Fails unless a figure that was just measured is the one in `text`, to a tenth: compilers round differently.
pub fn assert_documented(text: &str, case: &Case, asked: &Asked, error: f64) {
    let found = documented(text, case, asked);
    let number = |figure: &str| figure.split(' ').next().unwrap_or_default().parse::<f64>();
    let measured = value(error, asked.figure.unit);
    let agrees = match (number(&found), number(&measured)) {
        (Ok(found), Ok(measured)) => (found - measured).abs() <= 0.1 * found.max(measured) + 1e-4,
        _ => false,
    };
    assert!(
        agrees,
        "{}{found}, measured {measured}: run make accuracy",
        row(case, asked)
    );
}

/// What the document says was reached.
fn documented(text: &str, case: &Case, asked: &Asked) -> String {
    // Rows of one case under another heading would still differ in disagreements().
    let prefix = row(case, asked);
    (text.lines())
        .find_map(|line| line.strip_prefix(&prefix)?.strip_suffix(" |"))
        .unwrap_or_default()
        .to_owned()
}

/// The value beside `name` in the table at the top of `text`; empty if it is missing.
fn header(text: &str, name: &str) -> String {
    let cells = |line: &str| -> Vec<String> {
        (line.split('|').map(|cell| cell.trim().to_owned())).collect()
    };
    (text.lines().map(cells))
        .find(|cells| cells.len() == 4 && cells[1] == name)
        .map_or(String::new(), |mut cells| cells.swap_remove(2))
}

/// Whether the figures in `text` were measured on this device. Others round differently: of the light of the ellipsoid, 0.053 %
/// miss the focus on a GPU, and 0.061 % on lavapipe.
pub fn is_measured_on(text: &str, device: &DeviceInfo) -> bool {
    header(text, "Device") == device.name
}

/// Why `text` is not the document that the code would write on the machine that it names; empty if
/// it is.
pub fn disagreements(text: &str) -> Vec<String> {
    let header = |name| header(text, name);
    let run = Run {
        date: header("Date"),
        commit: header("Commit"),
        device: header("Device"),
        driver: header("Driver"),
        cpu: header("CPU"),
    };
    let mut wrong: Vec<String> = (run.rows().iter())
        .filter(|(_, value)| value.is_empty())
        .map(|(name, _)| format!("{name} is missing"))
        .collect();

    let mut reached = Vec::new();
    for case in cases() {
        for asked in case.asked {
            let prefix = row(case, asked);
            let found = documented(text, case, asked);
            let number = found.split(' ').next().unwrap_or_default();
            let bound = value(asked.bound, asked.figure.unit);
            let bound: f64 = bound.split(' ').next().unwrap().parse().unwrap();
            if !number
                .parse::<f64>()
                .is_ok_and(|number| (0.0..=bound).contains(&number))
            {
                wrong.push(format!("{prefix}`{found}` is not within what is asked"));
            }
            reached.push(found);
        }
    }
    let expected = document(&run, &reached);
    let mut lines = text.lines();
    for expected in expected.lines() {
        let line = lines.next();
        if line != Some(expected) {
            wrong.push(format!("{line:?} instead of `{expected}`"));
            break;
        }
    }
    wrong.extend(lines.next().map(|line| format!("`{line}` is too much")));
    wrong
}

fn heading(form: &Form) -> String {
    format!(
        "\n## {}\n\n```text\n{}\n```\n\nSource: {}.\n\n\
         | scene | computed by | texels | figure | asked | reached |\n|---|---|---|---|---|---|\n",
        form.title, form.formula, form.source
    )
}

/// All but the last cell.
fn row(case: &Case, asked: &Asked) -> String {
    let [width, height] = case.texels;
    format!(
        "| {} | {} | {width}×{height} | {} | {} | ",
        case.scene_text,
        solver(case),
        asked.figure.name,
        value(asked.bound, asked.figure.unit)
    )
}

/// In the words of the command line.
fn solver(case: &Case) -> String {
    match case.solver {
        Solver::Reference(error) => format!("`reference --error {error}`"),
        Solver::Renderer(settings) => {
            let settings: Settings = settings();
            let method = settings.method.name();
            let epsilon = if settings.method == Method::Pinhole {
                format!(" --epsilon {}", settings.epsilon)
            } else {
                String::new()
            };
            format!("`{method} --samples {}{epsilon}`", settings.samples)
        }
    }
}

/// In % or texels.
fn value(value: f64, unit: Unit) -> String {
    let (value, unit) = match unit {
        Unit::Relative => (100.0 * value, " %"),
        Unit::Texels => (value, ""),
    };
    let digits = if value < 0.001 {
        format!("{value:.1e}")
    } else {
        let digits = format!("{value:.4}");
        digits.trim_end_matches('0').trim_end_matches('.').into()
    };
    format!("{digits}{unit}")
}
