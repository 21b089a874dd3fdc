use nephroid::gpu::*;
use nephroid::render::*;
use nephroid::scene;
use std::time::Instant;
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let a: Vec<String> = std::env::args().collect();
    let scene = scene::load(a[1].as_ref())?.scene;
    let samples: u32 = a[2].parse()?;
    let width: u32 = a[3].parse()?;
    let method = match a[4].as_str() {
        "p" => Method::Points,
        "g" => Method::Pinhole,
        _ => Method::Footprint,
    };
    let ctx = Context::new(&ContextOptions { device: None, validate: std::env::var("V").is_ok() })?;
    println!("{:?}", ctx.info());
    let t = Instant::now();
    let mut r = Renderer::new(
        &ctx,
        &scene,
        &Settings { samples, method, light_map: Some(LightMapSize::Width(width)), ..Default::default() },
    )?;
    println!("setup {:?} samples {} notes {:?}", t.elapsed(), r.samples(), r.notes());
    let n = if a.len() > 6 { a[6].parse()? } else { 1 };
    for _ in 0..n {
        let t = Instant::now();
        r.caustic()?;
        println!("caustic {:?}", t.elapsed());
    }
    println!("footprints {:?}", r.footprints()?);
    r.wait_each_pass(true);
    r.take_times();
    r.caustic()?;
    for t in r.take_times() {
        println!("  {:14} gpu {:?} wall {:?}", t.name, t.gpu.map(|x| x * 1e3), t.wall.map(|x| x * 1e3));
    }
    for (i, _, _) in scene.receivers() {
        let m = r.read_caustic(i)?;
        let s: f64 = m.pixels.iter().map(|p| p[0] as f64).sum();
        let mx = m.pixels.iter().map(|p| p[0]).fold(0.0, f32::max);
        println!(
            "{} sum {} max {} bad {}",
            scene.objects[i].name,
            s,
            mx,
            m.pixels.iter().filter(|p| !p[0].is_finite()).count()
        );
        if a.len() > 5 {
            let mut im = image::RgbImage::new(m.width, m.height);
            for (p, q) in im.pixels_mut().zip(&m.pixels) {
                p.0 = q.map(|x| ((x * 0.5).powf(1. / 2.2) * 255.).min(255.) as u8);
            }
            im.save(format!("{}/{}.png", a[5], scene.objects[i].name))?;
        }
    }
    if a.len() > 5 {
        let t = Instant::now();
        r.wait_each_pass(true);
        r.take_times();
        r.view(&scene.camera, [1280, 720], 2)?;
        println!("view {:?}", t.elapsed());
        for t in r.take_times() {
            println!("  {:14} gpu {:?} wall {:?}", t.name, t.gpu.map(|x| x * 1e3), t.wall.map(|x| x * 1e3));
        }
        let m = r.read_view()?;
        let mut im = image::RgbImage::new(m.width, m.height);
        for (p, q) in im.pixels_mut().zip(&m.pixels) {
            p.0 = q.map(|x| ((x * 2.5).powf(1. / 2.2) * 255.).min(255.) as u8);
        }
        im.save(format!("{}/view.png", a[5]))?;
    }
    for m in ctx.validation_messages().iter().take(5) {
        println!("VALIDATION {m}");
    }
    Ok(())
}
