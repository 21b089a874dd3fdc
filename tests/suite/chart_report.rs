//! The report of speed against accuracy, from invented measurements: what the files say, and that
//! the page works in a browser.

use headless_chrome::browser::tab::point::Point as Pixel;
use headless_chrome::protocol::cdp::types::Event;
use headless_chrome::{Browser, LaunchOptions, Tab};
use nephroid::Error;
use nephroid::image_file::RgbImage;
use nephroid::measure::Spread;
use nephroid::measure::chart::{
    Chart, DeviceKind, Peer, Picture, Point, SCHEMA, SceneChart, Series, Strip, Thumbnail,
    read_peers, write,
};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const METHODS: [&str; 6] = [
    "footprint",
    "pinhole",
    "pinhole, ε = 0",
    "pinhole, no filter",
    "points",
    "beams",
];

/// A curve that falls by `slope` with time and flattens toward `floor`.
fn series(index: usize, floor: f64) -> Series {
    let (start, slope) = [
        (0.05, 0.62),
        (0.35, 0.5),
        (0.3, 0.55),
        (0.6, 0.3),
        (0.42, 0.5),
        (0.12, 0.35),
    ][index];
    let points = (0..7)
        .map(|step| {
            let samples = 1024 << (2 * step);
            let work = f64::from(1u32 << (2 * step));
            let median = 4.1e-4 * (1.0 + 0.3 * index as f64) + 6.3e-5 * work;
            let l1: f64 = start * work.powf(-slope);
            Point {
                samples,
                light_map: [256, 256],
                settings: format!("\"fast\", p_max = 4, k < 0.45 & {step}"),
                l1: l1.hypot(floor),
                l2: 1.7 * l1 + 1.0 / 3.0,
                energy_ratio: 1.0 + l1 / 30.0,
                wall: Spread {
                    median,
                    p05: 0.93 * median,
                    p95: 1.3 * median,
                },
                gpu: index.is_multiple_of(2).then_some(Spread {
                    median: 0.8 * median,
                    p05: 0.7 * median,
                    p95: 0.9 * median,
                }),
                above_floor: l1 > floor,
                note: (step == 3).then(|| "first frame\nleft out".into()),
            }
        })
        .collect();
    Series {
        label: METHODS[index].into(),
        points,
    }
}

/// A crescent of light, blurred by `width` and grained by `noise`.
fn crescent(width: f32, noise: f32) -> RgbImage {
    let size = 96usize;
    let pixels = (0..size * size)
        .map(|i| {
            let [x, y] = [i % size, i / size].map(|v| v as f32 / size as f32 * 2.0 - 1.0);
            let distance = (x.hypot(y) - 0.6 - 0.2 * x).abs();
            let grain = ((i.wrapping_mul(2_654_435_761u32 as usize) >> 7) % 1000) as f32 / 500.0;
            let light = (-(distance / width).powi(2)).exp() * (1.0 + noise * (grain - 1.0));
            [light, 0.9 * light, 0.7 * light]
        })
        .collect();
    RgbImage {
        width: size as u32,
        height: size as u32,
        pixels,
    }
}

fn strip(seconds: f64) -> Strip {
    let truth = crescent(0.1, 0.0);
    let thumbnails = (METHODS.iter().enumerate())
        .map(|(index, label)| {
            let blur = 0.1 + (index as f32) * 0.004 / (seconds as f32 * 100.0);
            let map = crescent(blur, if index == 4 { 0.5 } else { 0.02 });
            Thumbnail {
                label: (*label).into(),
                seconds: seconds * (1.0 + 0.02 * index as f64),
                l1: 0.01 * (1.0 + index as f64) / (100.0 * seconds),
                light_map: Picture::of_light_map(&map, 0.0),
                error: Picture::of_error(&map, &truth, 0.2),
            }
        })
        .collect();
    Strip {
        seconds,
        error_scale: 0.2,
        thumbnails,
    }
}

fn peer(name: &str, hardware: &str, seconds: f64, error: f64) -> Peer {
    Peer {
        name: name.into(),
        version: "1.2".into(),
        hardware: hardware.into(),
        scene: "ring".into(),
        seconds,
        error,
        note: Some("<script>throw 1</script>".into()),
    }
}

fn chart() -> Chart {
    let scene = |name: &str, floor, methods: usize, peers| SceneChart {
        scene: name.into(),
        receiver: "floor".into(),
        light_map: [256, 256],
        reference_error: floor,
        series: (0..methods).map(|index| series(index, floor)).collect(),
        peers,
        strips: [0.002, 0.008, 0.03].map(strip).into(),
        verdicts: vec!["points do not fall below 1 % & <why>.".into()],
    };
    let peers = vec![
        peer("photon mapper", "another  GPU", 0.08, 0.02),
        peer("photon mapper", "another  GPU", 0.8, 0.006),
        peer("path tracer", " example  gpu 1000 ", 0.3, 0.15),
    ];
    Chart {
        schema: SCHEMA,
        nephroid: "0.1.0".into(),
        commit: Some("0123456789ab".into()),
        date: "2024-05-06T07:08:09Z".into(),
        device: "Example GPU 1000".into(),
        driver: "example driver 1.2.3".into(),
        cpu: "Example CPU, 2 cores".into(),
        kind: DeviceKind::Hardware,
        scenes: vec![
            scene("ring", 0.002, 6, peers),
            scene("water", 0.0, 3, vec![]),
            scene("sphere <in> \"sky\"", 0.01, 5, vec![]),
        ],
    }
}

/// The report of [`chart`], in a folder that stays for the eye.
fn report(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    write(&chart(), &folder).unwrap();
    folder
}

/// A chart as it is without its pictures.
fn without_pictures(mut chart: Chart) -> Chart {
    for strip in chart.scenes.iter_mut().flat_map(|scene| &mut scene.strips) {
        for thumbnail in &mut strip.thumbnails {
            thumbnail.light_map = Picture::default();
            thumbnail.error = Picture::default();
        }
    }
    chart
}

#[test]
fn json_is_the_chart() {
    let text = std::fs::read_to_string(report("json").join("chart.json")).unwrap();
    let read: Chart = serde_json::from_str(&text).unwrap();
    let mut expected = without_pictures(chart());
    assert_eq!(read, expected);
    expected.scenes[1].series[2].points[4].wall.p95 *= 1.0 + f64::EPSILON;
    assert_ne!(read, expected);
}

#[test]
fn csv_has_every_point_to_the_last_bit() {
    let mut reader = csv::Reader::from_path(report("csv").join("chart.csv")).unwrap();
    let header = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(|row| row.unwrap()).collect();
    let field = |row: usize, name: &str| {
        let column = header.iter().position(|known| known == name).unwrap();
        rows[row].get(column).unwrap()
    };
    let number = |row, name| field(row, name).parse::<f64>().unwrap();
    let mut row = 0;
    let chart = chart();
    for scene in &chart.scenes {
        for series in &scene.series {
            for point in &series.points {
                assert_eq!(field(row, "scene"), scene.scene);
                assert_eq!(field(row, "method"), series.label);
                assert_eq!(field(row, "settings"), point.settings);
                assert_eq!(field(row, "note"), point.note.clone().unwrap_or_default());
                assert_eq!(number(row, "samples"), point.samples as f64);
                assert_eq!(number(row, "l1"), point.l1);
                assert_eq!(number(row, "l2"), point.l2);
                assert_eq!(number(row, "energy_ratio"), point.energy_ratio);
                assert_eq!(number(row, "wall_median_s"), point.wall.median);
                assert_eq!(number(row, "wall_p05_s"), point.wall.p05);
                assert_eq!(number(row, "wall_p95_s"), point.wall.p95);
                match point.gpu {
                    Some(time) => assert_eq!(number(row, "gpu_median_s"), time.median),
                    None => assert_eq!(field(row, "gpu_median_s"), ""),
                }
                row += 1;
            }
        }
        for peer in &scene.peers {
            assert_eq!(field(row, "renderer"), format!("{} 1.2", peer.name));
            assert_eq!(field(row, "hardware"), peer.hardware);
            assert_eq!(number(row, "wall_median_s"), peer.seconds);
            row += 1;
        }
    }
    assert_eq!(row, rows.len());
    // The fastest point of the best method is on the front, a peer from elsewhere never.
    assert_eq!(field(0, "pareto"), "true");
    let pareto = |name| {
        let row = (0..rows.len()).find(|&row| field(row, "renderer") == name);
        field(row.unwrap(), "pareto")
    };
    assert_eq!(pareto("photon mapper 1.2"), "false");
    assert_eq!(pareto("path tracer 1.2"), "false");
}

#[test]
fn what_cannot_be_drawn_or_written_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |change: fn(&mut Chart), part: &str| {
        let mut chart = chart();
        change(&mut chart);
        let error = write(&chart, folder.path()).unwrap_err();
        assert!(matches!(error, Error::Usage { .. }), "{error}");
        assert!(error.to_string().contains(part), "{error}");
    };
    refused(|c| c.scenes.clear(), "no scene");
    refused(|c| c.scenes[1].series.clear(), "scene water: nothing");
    refused(
        |c| c.scenes[0].series[1].points[2].l1 = f64::NAN,
        "point 3 of pinhole",
    );
    refused(
        |c| c.scenes[0].series[1].points[2].l1 = 0.0,
        "point 3 of pinhole",
    );
    refused(
        |c| c.scenes[0].series[0].points[0].wall.p05 = -1.0,
        "point 1 of footprint",
    );
    refused(|c| c.scenes[0].peers[2].seconds = 0.0, "path tracer 1.2");
    assert_eq!(folder.path().read_dir().unwrap().count(), 0);

    let error = write(&chart(), &folder.path().join("missing")).unwrap_err();
    assert!(matches!(error, Error::Output { .. }), "{error}");
}

#[test]
fn peers_are_read_and_what_is_wrong_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("peers.json");
    let read = |text: &str| {
        std::fs::write(&path, text).unwrap();
        read_peers(&path)
    };
    let entry = |seconds: &str, more: &str| {
        format!(
            "{{\n\"schema\": 1,\n\"peers\": [\n\
             {{\"name\": \"a\", \"version\": \"1\", \"hardware\": \"h\", \"scene\": \"ring\",\n\
             \"seconds\": 0.5, \"error\": 0.25}},\n\
             {{\"name\": \"photon mapper\", \"version\": \"2\", \"hardware\": \"h\",\n\
             \"scene\": \"ring\", \"seconds\": {seconds}, \"error\": 0.125{more}}}\n]\n}}\n"
        )
    };
    let peers = read(&entry("1e-3", ", \"note\": \"n\"")).unwrap();
    assert_eq!(peers.len(), 2);
    assert_eq!((peers[0].seconds, peers[0].error), (0.5, 0.25));
    assert_eq!(
        (peers[1].seconds, peers[1].note.as_deref()),
        (1e-3, Some("n"))
    );

    let refused = |text: &str, parts: &[&str]| {
        let error = read(text).unwrap_err();
        assert!(matches!(error, Error::Input { .. }), "{error}");
        let message = error.to_string();
        for part in ["peers.json"].iter().chain(parts) {
            assert!(message.contains(part), "{part}: {message}");
        }
    };
    refused(&entry("1e-3,", ""), &["line 7", "column"]);
    refused(
        &entry("1e-3", ", \"colour\": 1"),
        &["line 7", "unknown field `colour`"],
    );
    refused(&entry("\"fast\"", ""), &["line 7", "invalid type"]);
    refused(&entry("1e999", ""), &["line 7", "out of range"]);
    refused(
        &entry("-1", ""),
        &["entry 2 (photon mapper)", "seconds", "-1"],
    );
    refused(&entry("0", ""), &["entry 2", "seconds"]);
    refused(
        &entry("1", "").replace("0.25", "-0.25"),
        &["entry 1 (a)", "error"],
    );
    refused(
        &entry("1", "").replace("\"a\"", "\" \""),
        &["entry 1", "name", "empty"],
    );
    refused(
        &entry("1", "").replace("\"schema\": 1", "\"schema\": 9"),
        &["version 9"],
    );
    refused("", &["line 1"]);
    let error = read_peers(&folder.path().join("none.json")).unwrap_err();
    assert!(error.to_string().contains("none.json"), "{error}");
}

/// A browser without a window. `CHROME` names its program where it is in no usual place.
fn browser() -> Browser {
    let options = LaunchOptions::default_builder()
        // Chromium refuses its sandbox to root, and these pages are our own.
        .sandbox(false)
        .window_size(Some((1200, 900)))
        .build()
        .unwrap();
    Browser::new(options).expect("Chromium or Chrome is installed (.ci/setup test)")
}

/// Asks until `done`, or says what it waited for.
fn wait<T>(what: &str, mut done: impl FnMut() -> Option<T>) -> Result<T, String> {
    let start = Instant::now();
    loop {
        if let Some(value) = done() {
            return Ok(value);
        }
        if start.elapsed() > Duration::from_secs(60) {
            return Err(format!("waited in vain for {what}"));
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn evaluate(tab: &Tab, script: &str) -> Option<serde_json::Value> {
    tab.evaluate(script, false).ok()?.value
}

/// Middle of the first element of `selector` with `text`, px in the window.
fn middle(tab: &Tab, selector: &str, text: &str) -> Option<Pixel> {
    let script = format!(
        "(() => {{ const found = [...document.querySelectorAll({selector:?})]
           .find((e) => e.textContent.includes({text:?}));
         if (!found) return null;
         found.scrollIntoView({{ block: 'center' }});
         const box = found.getBoundingClientRect();
         return (box.x + box.width / 2) + ' ' + (box.y + box.height / 2); }})()"
    );
    let value = evaluate(tab, &script)?;
    let (x, y) = value.as_str()?.split_once(' ')?;
    Some(Pixel {
        x: x.parse().ok()?,
        y: y.parse().ok()?,
    })
}

/// Opens the page and does with it what a reader does.
fn try_page(browser: &Browser, page: &Path) -> Result<(), String> {
    let tab = browser.new_tab().map_err(|e| e.to_string())?;
    tab.set_default_timeout(Duration::from_secs(60));
    let complaints = Arc::new(Mutex::new(Vec::new()));
    let heard = complaints.clone();
    tab.enable_log().unwrap().enable_runtime().unwrap();
    tab.add_event_listener(Arc::new(move |event: &Event| match event {
        Event::LogEntryAdded(entry) => heard.lock().unwrap().push(entry.params.entry.text.clone()),
        Event::RuntimeExceptionThrown(thrown) => {
            let details = &thrown.params.exception_details;
            heard.lock().unwrap().push(details.text.clone());
        }
        Event::RuntimeConsoleAPICalled(call) => {
            heard
                .lock()
                .unwrap()
                .push(format!("{:?}", call.params.args));
        }
        _ => {}
    }))
    .unwrap();
    tab.navigate_to(&format!("file://{}", page.display()))
        .and_then(|tab| tab.wait_until_navigated())
        .map_err(|e| e.to_string())?;

    // Curves: methods, peers, the front, and where it is not 0 the reference's error.
    let curves = |index: usize| {
        let script =
            format!("document.querySelectorAll('#plot-{index} .scatterlayer .trace').length");
        evaluate(&tab, &script)?.as_u64()
    };
    for (index, expected) in [6 + 2 + 2, 3 + 1, 5 + 2].into_iter().enumerate() {
        wait(&format!("{expected} curves in plot {index}"), || {
            (curves(index) == Some(expected)).then_some(())
        })?;
    }
    let pictures = "[...document.images].filter((i) => i.complete && i.naturalWidth == 96).length";
    wait("pictures", || {
        (evaluate(&tab, pictures)?.as_u64()? == 3 * 3 * 6 * 2).then_some(())
    })?;

    // The first point of the first curve after the front and the floor.
    let point = "#plot-0 .scatterlayer .trace:nth-child(3) .points path";
    let at = wait("a point", || middle(&tab, point, ""))?;
    tab.move_mouse_to_point(at).map_err(|e| e.to_string())?;
    let label = "document.querySelector('#plot-0 .hoverlayer')?.textContent";
    let text = wait("a label", || {
        evaluate(&tab, label)?
            .as_str()
            .filter(|text| !text.is_empty())
            .map(String::from)
    })?;
    for part in [
        "footprint",
        "\"fast\", p_max = 4, k < 0.45 & 0",
        "1024 samples",
        "L1 5.00 %",
    ] {
        if !text.contains(part) {
            return Err(format!("no {part} in {text}"));
        }
    }

    let at = wait("a legend", || {
        middle(&tab, "#plot-0 .legend .traces", "ε = 0")
    })?;
    tab.click_point(at).map_err(|e| e.to_string())?;
    wait("a curve to go", || (curves(0) == Some(9)).then_some(()))?;

    let complaints = complaints.lock().unwrap();
    if complaints.is_empty() {
        Ok(())
    } else {
        Err(complaints.join("; "))
    }
}

#[test]
fn the_page_works_in_a_browser() {
    let page = report("page").join("chart.html");
    let browser = browser();
    try_page(&browser, &page).unwrap();

    // The trial notices what breaks a page.
    let html = std::fs::read_to_string(&page).unwrap();
    let broken = |from: &str, to: &str, part: &str| {
        assert!(html.contains(from), "{from}");
        let twin = page.with_file_name("broken.html");
        std::fs::write(&twin, html.replacen(from, to, 1)).unwrap();
        let complaint = try_page(&browser, &twin).unwrap_err();
        assert!(complaint.contains(part), "{complaint}");
    };
    broken(
        "</body>",
        "<script>throw new Error('broken')</script></body>",
        "Uncaught",
    );
    broken(
        "</body>",
        "<script src=\"https://example.invalid/\"></script></body>",
        "Content Security",
    );
    broken("k \\u0026lt; 0.45 \\u0026amp; 0", "k", "p_max");
}

#[test]
fn the_drawing_is_well_formed() {
    let folder = report("drawing");
    let browser = browser();
    let tab = browser.new_tab().unwrap();
    let open = |name: &str| {
        tab.navigate_to(&format!("file://{}", folder.join(name).display()))
            .unwrap()
            .wait_until_navigated()
            .unwrap();
        let script = "document.querySelector('parsererror') ? 'broken' : \
                      document.documentElement.nodeName + ' ' + document.querySelectorAll('text').length";
        evaluate(&tab, script).unwrap().as_str().unwrap().to_owned()
    };
    let result = open("chart.svg");
    let texts: usize = result.strip_prefix("svg ").unwrap().parse().unwrap();
    assert!(texts > 40, "{texts} texts");

    let svg = std::fs::read_to_string(folder.join("chart.svg")).unwrap();
    for part in METHODS {
        assert!(svg.contains(part), "{part}");
    }
    std::fs::write(folder.join("broken.svg"), svg.replacen("</text>", "", 1)).unwrap();
    assert_eq!(open("broken.svg"), "broken");
}
