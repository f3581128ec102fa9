//! A sheet of what image randomization does: a scene made here, one row for each of the levels 0, 0.25, 0.5 and 1, and in each
//! row six episodes; then one row of single effects, in the order of the registry, at the upper ends of their ranges.
//!
//! ```text
//! cargo run --release --example image_randomization -- out/images.ppm
//! ```

#![allow(clippy::print_stdout, clippy::print_stderr, reason = "what it prints is what it is for")]

use std::process::ExitCode;

use trueup::sim2real::Seed;
use trueup::sim2real::randomize::image::{
    EFFECTS, Fill, ImageError, ImageIndex, ImageMut, ImageRandomizer, Ranges, Shape, Workspace,
};

const SIDE: usize = 128;
const COLUMNS: usize = 6;
/// White between pictures [px].
const GAP: usize = 4;

fn main() -> ExitCode {
    let path = std::env::args().nth(1).unwrap_or_else(|| "images.ppm".to_owned());
    let written = sheet().map_err(|error| error.to_string()).and_then(|sheet| {
        std::fs::write(&path, sheet).map_err(|error| format!("{path}: {error}\nhint: give a file that can be written"))
    });
    match written {
        Ok(()) => {
            println!("{path}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}

/// Red, green and blue at a place of the scene: a wall that gets brighter upwards with two discs on it, a chequered floor.
fn scene(x: usize, y: usize) -> [u8; 3] {
    let [x, y] = [x, y].map(|at| (at as f64 + 0.5) / SIDE as f64);
    let within = |[cx, cy, radius]: [f64; 3]| (x - cx).hypot(y - cy) < radius;
    if within([0.32, 0.36, 0.17]) {
        [200, 60, 50]
    } else if within([0.7, 0.55, 0.12]) {
        [60, 110, 190]
    } else if y > 0.6 {
        let even = ((x * 8.0) as usize + (y * 8.0) as usize).is_multiple_of(2);
        if even { [225, 220, 205] } else { [50, 60, 55] }
    } else {
        let light = 110.0 + 120.0 * (0.6 - y) / 0.6;
        [light as u8, light as u8, (0.9 * light) as u8]
    }
}

fn picture(ranges: &Ranges, episode: u64) -> Result<Vec<u8>, ImageError> {
    let mut values: Vec<u8> = (0..SIDE * SIDE).flat_map(|at| scene(at % SIDE, at / SIDE)).collect();
    let image = ImageMut::new(&mut values, Shape::new(SIDE, SIDE, 3)?)?;
    let randomizer = ImageRandomizer::new(ranges.clone(), Seed(7));
    randomizer.apply(image, &[ImageIndex { episode, frame: 0 }], &mut Workspace::new())?;
    Ok(values)
}

/// All pictures as a portable pixmap (PPM).
fn sheet() -> Result<Vec<u8>, ImageError> {
    let all = Ranges::plausible().filled_with(Fill::Mean)?;
    let mut pictures = Vec::new();
    for level in [0.0, 0.25, 0.5, 1.0] {
        let ranges = all.at_level(level)?;
        for episode in 0..COLUMNS as u64 {
            pictures.push(picture(&ranges, episode)?);
        }
    }
    for effect in EFFECTS {
        let end = effect
            .parameters
            .iter()
            .try_fold(Ranges::none(), |ranges, p| ranges.with(effect.name, p.name, [p.plausible[1]; 2]))?;
        pictures.push(picture(&end, 0)?);
    }
    let rows = pictures.len().div_ceil(COLUMNS);
    let [width, height] = [COLUMNS, rows].map(|count| count * (SIDE + GAP) + GAP);
    let mut values = vec![255; width * height * 3];
    for (at, picture) in pictures.iter().enumerate() {
        let [left, top] = [at % COLUMNS, at / COLUMNS].map(|k| k * (SIDE + GAP) + GAP);
        for (row, line) in picture.chunks_exact(SIDE * 3).enumerate() {
            let start = ((top + row) * width + left) * 3;
            values[start..start + line.len()].copy_from_slice(line);
        }
    }
    let mut file = format!("P6\n{width} {height}\n255\n").into_bytes();
    file.append(&mut values);
    Ok(file)
}
