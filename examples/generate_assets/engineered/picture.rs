//! The picture that the plate throws on the wall: the caustic in a round cup, and the name of the program.

use glam::DVec2;
use std::f64::consts::{PI, TAU};

/// Pixels on a side.
pub const SIDE: usize = 256;
/// Radiant exposure of the ground, the letters and the rim of the cup, relative to one another. The plate spreads light by the
/// square root of the ratio of the extremes: beyond 16, it would need slopes that cast light past the picture.
const GROUND: f64 = 0.13;
const LETTERS: f64 = 1.0;
const RIM: f64 = 0.8;
/// Of the brightest spots of the cup. An exponential shoulder, from this multiple of the mean of the cup on, makes their range fit.
const CUP: f64 = 1.7;
const SHOULDER: f64 = 6.0;
/// Edges are so soft, in pixels: standard deviation of the blur.
const SOFTNESS: f64 = 2.4;

/// Centre and radius of the cup. The picture is the square [−1, 1]², y upward.
const CENTRE: DVec2 = DVec2::new(0.0, 0.2);
const RADIUS: f64 = 0.66;

/// Irradiance of the pixels, rows from the top. Their mean is 1.
pub fn irradiance() -> Vec<f64> {
    let cup = cup();
    let cup_pixels = PI * (RADIUS * SIDE as f64 / 2.0).powi(2);
    let shoulder = SHOULDER * cup.iter().sum::<f64>() / cup_pixels;
    let mut picture: Vec<f64> = (0..SIDE * SIDE)
        .map(|i| {
            let at = place(i);
            let from_centre = at.distance(CENTRE);
            let mut value = GROUND;
            if from_centre < RADIUS {
                value = value.max(CUP * (1.0 - (-cup[i] / shoulder).exp()));
            }
            let stroke = |distance: f64, half_width: f64| {
                (0.5 - (distance - half_width) * SIDE as f64 / 2.0).clamp(0.0, 1.0)
            };
            value += (RIM - value) * stroke((from_centre - RADIUS).abs(), 0.022);
            value + (LETTERS - value) * stroke(from_letters(at), 0.026)
        })
        .collect();
    blur(&mut picture);
    let mean = picture.iter().sum::<f64>() / picture.len() as f64;
    picture.iter_mut().for_each(|value| *value /= mean);
    picture
}

/// The irradiance at a place, bilinear between the middles of pixels.
pub fn value(picture: &[f64], at: DVec2) -> f64 {
    let last = (SIDE - 1) as f64;
    let place = |at: f64| ((at + 1.0) * SIDE as f64 / 2.0 - 0.5).clamp(0.0, last - 1e-9);
    let (x, y) = (place(at.x), place(-at.y));
    let first = y as usize * SIDE + x as usize;
    let mixed = |row: usize| {
        let [left, right] = [row, row + 1].map(|i| picture[i]);
        left + (right - left) * x.fract()
    };
    let [upper, lower] = [first, first + SIDE].map(mixed);
    upper + (lower - upper) * y.fract()
}

/// The middle of a pixel.
fn place(pixel: usize) -> DVec2 {
    let step = 2.0 / SIDE as f64;
    let (column, row) = (pixel % SIDE, pixel / SIDE);
    DVec2::new(
        (column as f64 + 0.5) * step - 1.0,
        1.0 - (row as f64 + 0.5) * step,
    )
}

/// Light from above that the wall of a cup reflects once: its caustic is a nephroid. Rays leave their trace along their way.
fn cup() -> Vec<f64> {
    const RAYS: usize = 2048;
    const STEPS: usize = 512;
    let mut light = vec![0.0; SIDE * SIDE];
    // Unit, as 8² + 15² = 17².
    let down = DVec2::new(8.0, -15.0) / 17.0;
    for ray in 0..RAYS {
        let across = 2.0 * (ray as f64 + 0.5) / RAYS as f64 - 1.0;
        let on_wall = across * down.perp() + (1.0 - across * across).sqrt() * down;
        let reflected = down - 2.0 * down.dot(on_wall) * on_wall;
        let chord = -2.0 * reflected.dot(on_wall);
        for step in 0..STEPS {
            let at = on_wall + (step as f64 + 0.5) / STEPS as f64 * chord * reflected;
            splat(&mut light, CENTRE + RADIUS * at, chord);
        }
    }
    light
}

/// Adds light at a place, shared by the four pixels around it.
fn splat(light: &mut [f64], at: DVec2, value: f64) {
    let x = (at.x + 1.0) * SIDE as f64 / 2.0 - 0.5;
    let y = (1.0 - at.y) * SIDE as f64 / 2.0 - 0.5;
    for (column, of_x) in [(x.floor(), 1.0 - x.fract()), (x.floor() + 1.0, x.fract())] {
        for (row, of_y) in [(y.floor(), 1.0 - y.fract()), (y.floor() + 1.0, y.fract())] {
            light[row as usize * SIDE + column as usize] += of_x * of_y * value;
        }
    }
}

/// Distance to the word below the cup.
fn from_letters(at: DVec2) -> f64 {
    const WIDTH: f64 = 0.132;
    const HEIGHT: f64 = 0.2;
    const GAP: f64 = 0.078;
    const BOTTOM: f64 = -0.86;
    let word = "NEPHROID";
    // An I has no width.
    let width = |letter: char| if letter == 'I' { 0.0 } else { WIDTH };
    let length: f64 = word.chars().map(|letter| width(letter) + GAP).sum::<f64>() - GAP;
    let mut left = -length / 2.0;
    let mut nearest = f64::INFINITY;
    for letter in word.chars() {
        let local = DVec2::new(at.x - left, at.y - BOTTOM);
        for stroke in strokes(letter, WIDTH, HEIGHT) {
            for pair in stroke.windows(2) {
                nearest = nearest.min(from_segment(local, pair[0], pair[1]));
            }
        }
        left += width(letter) + GAP;
    }
    nearest
}

/// The lines of a letter in the rectangle from 0 to (w, h).
fn strokes(letter: char, w: f64, h: f64) -> Vec<Vec<DVec2>> {
    let line = |points: &[(f64, f64)]| points.iter().map(|&point| DVec2::from(point)).collect();
    // From the top of a half ring at the right of x = `from` down to its lower end.
    let bow = |from: f64, low: f64, high: f64| -> Vec<DVec2> {
        let (radii, middle) = (DVec2::new(w - from, (high - low) / 2.0), (low + high) / 2.0);
        let arc = (0..=12).map(|i| {
            let turn = DVec2::from_angle(PI * (0.5 - f64::from(i) / 12.0));
            DVec2::new(from, middle) + radii * turn
        });
        let ends = [high, low].map(|y| DVec2::new(0.0, y));
        [ends[0]].into_iter().chain(arc).chain([ends[1]]).collect()
    };
    let stem = line(&[(0.0, 0.0), (0.0, h)]);
    match letter {
        'N' => vec![line(&[(0.0, 0.0), (0.0, h), (w, 0.0), (w, h)])],
        'E' => vec![
            line(&[(w, 0.0), (0.0, 0.0), (0.0, h), (w, h)]),
            line(&[(0.0, 0.5 * h), (0.8 * w, 0.5 * h)]),
        ],
        'P' => vec![stem, bow(0.45 * w, 0.45 * h, h)],
        'R' => vec![
            stem,
            bow(0.45 * w, 0.45 * h, h),
            line(&[(0.45 * w, 0.45 * h), (w, 0.0)]),
        ],
        'H' => vec![
            stem,
            line(&[(w, 0.0), (w, h)]),
            line(&[(0.0, 0.5 * h), (w, 0.5 * h)]),
        ],
        'O' => {
            let point = |i: i32| {
                let turn = DVec2::from_angle(TAU * f64::from(i) / 24.0);
                DVec2::new(0.5 * w, 0.5 * h) * (DVec2::ONE + turn)
            };
            vec![(0..=24).map(point).collect()]
        }
        'I' => vec![stem],
        'D' => vec![stem, bow(0.3 * w, 0.0, h)],
        _ => unreachable!("not in the word"),
    }
}

fn from_segment(at: DVec2, from: DVec2, to: DVec2) -> f64 {
    let along = to - from;
    let share = ((at - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    at.distance(from + share * along)
}

/// By a Gaussian of [`SOFTNESS`]. Beyond the edge, the picture continues mirrored.
fn blur(picture: &mut [f64]) {
    const REACH: i32 = (4.0 * SOFTNESS) as i32;
    let weights: Vec<f64> = (-REACH..=REACH)
        .map(|i| (-0.5 * (f64::from(i) / SOFTNESS).powi(2)).exp())
        .collect();
    let total: f64 = weights.iter().sum();
    let side = SIDE as i32;
    let inside = |i: i32| if i < 0 { -1 - i } else { i.min(2 * side - 1 - i) } as usize;
    for [along, across] in [[1, SIDE], [SIDE, 1]] {
        let before = picture.to_vec();
        for line in 0..SIDE {
            for i in 0..side {
                let sum: f64 = (weights.iter().zip(-REACH..))
                    .map(|(weight, offset)| {
                        weight * before[line * across + inside(i + offset) * along]
                    })
                    .sum();
                picture[line * across + i as usize * along] = sum / total;
            }
        }
    }
}
