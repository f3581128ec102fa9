//! What a randomized image costs on one thread: 84 x 84 x 3, the size of DrQ, effect by effect and all of them. Beside it in
//! the same run a copy of the bytes, and a plain loop that adds a number to each of them.
//!
//! Once measured on a thread of an AMD EPYC (Zen 3), the fastest of 120 batches of 64 images [us per image]: all ten effects 43.6 where each
//! image has a map of its own, 36.8 while lens and shift are held; before images went through in bands, 49.8 and 43.0 in the same run. In an
//! hour in which others use the machine means of this bench are half as large again.
#![allow(missing_docs, clippy::expect_used, reason = "a bench has no users, and ends where the registry lacks a row")]

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use trueup::sim2real::Seed;
use trueup::sim2real::randomize::image::{
    EFFECTS, ImageError, ImageIndex, ImageMut, ImageRandomizer, ImageView, Per, Ranges, Shape, Value, Workspace,
};

const IMAGES: usize = 64;
const SHAPE: Shape = Shape { height: 84, width: 84, channels: 3 };

fn bytes() -> Vec<u8> {
    (0..SHAPE.values() * IMAGES).map(|at| (at.wrapping_mul(2_654_435_761) >> 7) as u8).collect()
}

/// Ranges of which every draw does something: ends are moved away from where nothing is done.
fn acting(only: Option<&str>) -> Result<Ranges, ImageError> {
    let mut ranges = Ranges::none();
    for effect in EFFECTS.iter().filter(|effect| only.is_none_or(|name| name == effect.name)) {
        for parameter in effect.parameters {
            let [low, high] = parameter.plausible;
            ranges = ranges.with(effect.name, parameter.name, [low + 0.6 * (high - low), high])?;
        }
    }
    Ok(ranges)
}

/// Images of one episode, or each of its own.
fn indices(episodes: bool) -> Vec<ImageIndex> {
    let index = |k: u64| if episodes { ImageIndex { episode: k, frame: 0 } } else { ImageIndex { episode: 0, frame: k } };
    (0..IMAGES as u64).map(index).collect()
}

fn measure<V: Value>(criterion: &mut Criterion, name: &str, source: &[V], ranges: Ranges, indices: &[ImageIndex]) {
    let mut group = criterion.benchmark_group("image_84x84x3");
    group.throughput(Throughput::Elements(IMAGES as u64)).sample_size(30);
    let randomizer = ImageRandomizer::new(ranges, Seed(1));
    let mut workspace = Workspace::new();
    let mut target = source.to_vec();
    group.bench_function(name, |b| {
        b.iter(|| {
            let source = ImageView::batch(source, IMAGES, SHAPE).expect("a batch");
            let target = ImageMut::batch(&mut target, IMAGES, SHAPE).expect("a batch");
            randomizer.apply_into(source, target, indices, &mut workspace).expect("images");
        });
    });
    group.finish();
}

fn references(criterion: &mut Criterion, source: &[u8]) {
    let mut group = criterion.benchmark_group("image_84x84x3");
    group.throughput(Throughput::Elements(IMAGES as u64)).sample_size(30);
    let mut target = source.to_vec();
    group.bench_function("reference_copy", |b| b.iter(|| target.copy_from_slice(black_box(source))));
    group.bench_function("reference_add", |b| {
        let offset = black_box(12.5);
        b.iter(|| {
            for (target, value) in target.iter_mut().zip(black_box(source)) {
                *target = (f32::from(*value) + offset).clamp(0.0, 255.0) as u8;
            }
        });
    });
    group.finish();
}

fn images(criterion: &mut Criterion) {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("one thread");
    let source = bytes();
    references(criterion, &source);
    for effect in EFFECTS {
        measure(criterion, effect.name, &source, acting(Some(effect.name)).expect("ranges"), &indices(false));
    }
    let all = acting(None).expect("ranges");
    measure(criterion, "all", &source, all.clone(), &indices(false));
    measure(criterion, "all_of_new_episodes", &source, all.clone(), &indices(true));
    let held = all.clone().drawn("shift", Per::Episode).expect("an effect");
    measure(criterion, "all_lens_and_shift_held", &source, held.clone(), &indices(false));
    let core = held.clone().without("blur").and_then(|ranges| ranges.without("shift")).expect("effects");
    measure(criterion, "all_but_blur_and_shift", &source, core, &indices(false));
    measure(criterion, "plausible", &source, Ranges::plausible(), &indices(false));
    let floats: Vec<f32> = source.iter().map(|byte| f32::from(*byte) / 255.0).collect();
    measure(criterion, "all_float", &floats, all, &indices(false));
}

criterion_group!(benches, images);
criterion_main!(benches);
