//! Randomized images from outside: the registry's promises, repeatability, floats beside bytes, and images of any shape.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use proptest::prelude::*;
use trueup::sim2real::Seed;
use trueup::sim2real::randomize::image::{
    Border, EFFECTS, Fill, ImageError, ImageIndex, ImageMut, ImageRandomizer, ImageView, Per, Ranges, Settings, Shape,
    Value, Workspace,
};

fn bytes(count: usize, seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    (0..count).map(|_| next()).collect()
}

fn frames(count: u64) -> Vec<ImageIndex> {
    (0..count).map(|k| ImageIndex { episode: k / 3, frame: k }).collect()
}

fn randomized<V: Value>(ranges: &Ranges, images: &[V], shape: Shape, indices: &[ImageIndex]) -> Vec<V> {
    let mut changed = images.to_vec();
    let batch = ImageMut::batch(&mut changed, indices.len(), shape).unwrap();
    ImageRandomizer::new(ranges.clone(), Seed(7)).apply(batch, indices, &mut Workspace::new()).unwrap();
    changed
}

/// An effect alone, each of its parameters drawn from the upper half of its plausible range.
fn alone(name: &str) -> Ranges {
    let effect = EFFECTS.iter().find(|effect| effect.name == name).unwrap();
    let upper = |ranges: Ranges, p: &trueup::sim2real::randomize::image::EffectParameter| {
        let [low, high] = p.plausible;
        ranges.with(name, p.name, [0.3 * low + 0.7 * high, high]).unwrap()
    };
    effect.parameters.iter().fold(Ranges::none(), upper)
}

#[test]
fn every_row_of_the_registry_says_what_it_is() {
    for (at, effect) in EFFECTS.iter().enumerate() {
        assert!(EFFECTS[..at].iter().all(|other| other.name != effect.name));
        assert!(!effect.title.is_empty() && !effect.law.is_empty() && !effect.source.is_empty(), "{}", effect.name);
        for p in effect.parameters {
            let [low, high] = p.plausible;
            assert!(p.bounds[0] <= low && low < high && high <= p.bounds[1], "{}.{}", effect.name, p.name);
            assert!(p.bounds[0] <= p.identity && p.identity <= p.bounds[1] && !p.unit.is_empty());
        }
    }
}

#[test]
fn an_effect_at_its_identity_changes_no_bit_and_otherwise_some() {
    for channels in [1, 3, 4] {
        let shape = Shape::new(20, 30, channels).unwrap();
        let images = bytes(6 * shape.values(), 5);
        let floats: Vec<f32> = images.iter().map(|byte| f32::from(*byte) / 255.0).collect();
        assert_eq!(randomized(&Ranges::none(), &images, shape, &frames(6)), images);
        for effect in EFFECTS {
            let acting = alone(effect.name);
            let still = acting.at_level(0.0).unwrap();
            assert_eq!(randomized(&still, &images, shape, &frames(6)), images, "{}", effect.name);
            assert_eq!(randomized(&still, &floats, shape, &frames(6)), floats, "{}", effect.name);
            let colour = ["white_balance", "hue_saturation"].contains(&effect.name);
            let changes = randomized(&acting, &images, shape, &frames(6)) != images;
            assert_eq!(changes, !(colour && channels == 1), "{} of {channels} channels", effect.name);
            // Of alpha, only what moves pixels.
            let moves = ["lens", "shift"].contains(&effect.name);
            if channels == 4 && !moves {
                let alpha = |values: &[u8]| values.iter().skip(3).step_by(4).copied().collect::<Vec<_>>();
                assert_eq!(alpha(&randomized(&acting, &images, shape, &frames(6))), alpha(&images), "{}", effect.name);
            }
        }
    }
}

/// Batches of any size, any number of threads, in place or into another buffer, in a workspace used before.
#[test]
fn the_same_seed_and_index_give_the_same_bits() {
    for shape in [Shape::new(19, 23, 3).unwrap(), Shape::new(8, 5, 1).unwrap()] {
        let (size, indices) = (shape.values(), frames(17));
        let images = bytes(17 * size, 3);
        let ranges = Ranges::plausible().filled_with(Fill::Noise).unwrap();
        let expected = randomized(&ranges, &images, shape, &indices);
        let randomizer = ImageRandomizer::new(ranges.clone(), Seed(7));
        for threads in [1, 2, 3, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| assert_eq!(randomized(&ranges, &images, shape, &indices), expected, "{threads} threads"));
        }
        let mut workspace = Workspace::new();
        let mut target = vec![0; images.len()];
        // From the last to the first, some at a time.
        for each in [1, 4] {
            for start in (0..17).step_by(each).rev() {
                let end = (start + each).min(17);
                let part = start * size..end * size;
                let source = ImageView::batch(&images[part.clone()], end - start, shape).unwrap();
                let into = ImageMut::batch(&mut target[part], end - start, shape).unwrap();
                randomizer.apply_into(source, into, &indices[start..end], &mut workspace).unwrap();
            }
            assert_eq!(target, expected);
            target.fill(9);
        }
        // By settings, one image at a time.
        let mut one = images[5 * size..6 * size].to_vec();
        let settings = randomizer.settings(indices[5]);
        settings.apply(ImageMut::new(&mut one, shape).unwrap(), &mut workspace).unwrap();
        assert_eq!(one, expected[5 * size..6 * size]);
        let other = ImageRandomizer::new(ranges, Seed(8));
        assert_ne!(other.settings(indices[5]), settings);
    }
}

/// Written down once: a change of these bits changes what every policy was trained on.
#[test]
fn golden_image() {
    let shape = Shape::new(5, 7, 3).unwrap();
    let ranges = Ranges::plausible().filled_with(Fill::Noise).unwrap().with("occlusion", "count", [1.0, 1.0]).unwrap();
    insta::assert_debug_snapshot!(
        randomized(&ranges, &bytes(shape.values(), 1), shape, &frames(1)).chunks(21).collect::<Vec<_>>()
    );
}

#[test]
fn settings_hold_for_an_episode_or_an_image() {
    let ranges = Ranges::plausible().drawn("noise", Per::Image).unwrap();
    let randomizer = ImageRandomizer::new(ranges, Seed(7));
    let settings = |episode, frame| randomizer.settings(ImageIndex { episode, frame });
    let (first, next, other) = (settings(4, 0), settings(4, 1), settings(5, 0));
    assert_eq!((first.lens, first.blur, first.hue_saturation), (next.lens, next.blur, next.hue_saturation));
    assert_ne!(first.noise, next.noise);
    assert_ne!(first.key, next.key);
    assert!(first.lens != other.lens && first.exposure != other.exposure && first.contrast != other.contrast);
    let shifts: Vec<_> = (0..20).map(|frame| settings(4, frame).shift).collect();
    assert!(shifts.iter().any(|shift| *shift != shifts[0]));
}

/// Another effect more or less changes no effect's draws.
#[test]
fn effects_are_drawn_by_themselves() {
    let with = |ranges: Ranges| ImageRandomizer::new(ranges, Seed(7)).settings(ImageIndex { episode: 3, frame: 9 });
    let (all, some) = (with(Ranges::plausible()), with(Ranges::plausible().without("lens").unwrap()));
    assert_eq!(Settings { lens: all.lens, ..some }, all);
    assert_eq!(some.lens, Settings::NONE.lens);
}

#[test]
fn draws_fill_their_ranges_evenly() {
    let randomizer = ImageRandomizer::new(Ranges::plausible(), Seed(1));
    let settings: Vec<Settings> = (0..9_000).map(|episode| randomizer.settings(ImageIndex { episode, frame: 0 })).collect();
    for shift in -4..=4 {
        let count = settings.iter().filter(|s| s.shift.x == shift as f32).count();
        assert!((count as f64 - 1_000.0).abs() < 4.5 * 30.0, "{shift}: {count}");
    }
    for tenth in 0..10 {
        let inside = |x: f32| ((x + 0.5) * 10.0).floor() == tenth as f32;
        let count = settings.iter().filter(|s| inside(s.exposure.stops)).count();
        assert!((count as f64 - 900.0).abs() < 4.5 * 28.5, "{tenth}: {count}");
    }
    // Two effects do not go together: the correlation of 9,000 pairs has a deviation of 1 / sqrt(9,000).
    let product = |s: &Settings| f64::from(s.exposure.stops) / 0.2887 * f64::from(s.brightness.offset) / 0.0577;
    let correlation = settings.iter().map(product).sum::<f64>() / 9_000.0;
    assert!(correlation.abs() < 4.5 / 9_000_f64.sqrt(), "{correlation}");
    let covered: Vec<_> = settings.iter().map(|s| s.occlusion.rectangles.iter().filter(|r| r.width > 0.0).count()).collect();
    for count in 0..=2 {
        let found = covered.iter().filter(|n| **n == count).count();
        assert!((found as f64 - 3_000.0).abs() < 4.5 * 45.0, "{count}: {found}");
    }
    for r in settings.iter().flat_map(|s| s.occlusion.rectangles).filter(|r| r.width > 0.0) {
        assert!(r.left >= 0.0 && r.top >= 0.0 && r.left + r.width <= 1.000_001 && r.top + r.height <= 1.000_001, "{r:?}");
        assert!((0.0199..0.1001).contains(&(r.width * r.height)), "{r:?}");
    }
}

#[test]
fn ranges_shrink_with_the_level() {
    let half = Ranges::plausible().at_level(0.5).unwrap();
    for (effect, ranges) in half.iter() {
        for (parameter, [low, high]) in effect.parameters.iter().zip(ranges) {
            let mid = |end: f64| 0.5 * (end + parameter.identity);
            assert!((low - mid(parameter.plausible[0])).abs() < 1e-12 && (high - mid(parameter.plausible[1])).abs() < 1e-12);
        }
    }
    assert_eq!(Ranges::plausible().at_level(1.0).unwrap(), Ranges::plausible());
    assert_eq!(Ranges::plausible().at_level(0.0).unwrap(), Ranges::none());
}

#[test]
fn what_cannot_be_is_told_with_a_hint() {
    let plausible = Ranges::plausible;
    let shape = Shape::new(2, 2, 3).unwrap();
    let mut values = [0_u8; 24];
    let index = ImageIndex { episode: 0, frame: 0 };
    let randomizer = ImageRandomizer::new(plausible(), Seed(1));
    let indices =
        randomizer.apply(ImageMut::batch(&mut values, 2, shape).unwrap(), &[index], &mut Workspace::new()).unwrap_err();
    let other = Shape::new(2, 1, 3).unwrap();
    let source = ImageView::batch(&[0_u8; 24], 4, other).unwrap();
    let target = ImageMut::batch(&mut values, 2, shape).unwrap();
    let shapes = randomizer.apply_into(source, target, &[index; 4], &mut Workspace::new()).unwrap_err();
    let errors: [(ImageError, &[&str]); 12] = [
        (indices, &["2 image(s) and 1 indices"]),
        (shapes, &["4 image(s) of 2 x 1 x 3", "2 of 2 x 2 x 3"]),
        (
            plausible().with("brigtness", "offset", [0.0, 0.1]).unwrap_err(),
            &["\"brigtness\"", "did you mean \"brightness\"?"],
        ),
        (plausible().drawn("bright", Per::Image).unwrap_err(), &["\"bright\""]),
        (plausible().with("noise", "reed", [0.0, 0.1]).unwrap_err(), &["noise has no parameter \"reed\"", "read, shot"]),
        (plausible().with("noise", "read", [0.2, 0.1]).unwrap_err(), &["noise.read from 0.2 to 0.1"]),
        (plausible().with("noise", "read", [0.0, f64::NAN]).unwrap_err(), &["noise.read from 0 to NaN"]),
        (plausible().with("noise", "read", [-0.1, 0.1]).unwrap_err(), &["-0.1", "from 0 to 1"]),
        (plausible().at_level(1.5).unwrap_err(), &["the level is 1.5"]),
        (plausible().focal_length(0.0).unwrap_err(), &["lens.focal_length is 0"]),
        (plausible().filled_with(Fill::Constant(7.0)).unwrap_err(), &["occlusion.fill is 7"]),
        (plausible().bordered_by(Border::Constant(f32::NAN)).unwrap_err(), &["lens.border is NaN"]),
    ];
    for (error, texts) in errors {
        let told = error.to_string();
        assert!(told.contains("\nhint: ") && texts.iter().all(|text| told.contains(text)), "{told}");
    }
    assert_eq!(values, [0; 24]);
    // One value that is none, and no image of the batch is touched.
    let mut floats = [0.5_f32; 24];
    floats[20] = f32::NAN;
    let batch = ImageMut::batch(&mut floats, 2, shape).unwrap();
    let error = randomizer.apply(batch, &[index; 2], &mut Workspace::new()).unwrap_err();
    assert!(matches!(error, ImageError::Value { image: 1, row: 1, column: 0, channel: 2, .. }), "{error}");
    assert!(floats[..20].iter().all(|value| *value == 0.5));
    // A batch of none is one.
    let none = ImageMut::batch(&mut floats[..0], 0, shape).unwrap();
    assert_eq!(randomizer.apply(none, &[], &mut Workspace::new()), Ok(()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]

    /// Of any shape, at any level: no panic, values within their range, and bytes as floats to within a rounding.
    #[test]
    fn images_of_any_shape_stay_images(
        height in 1_usize..24, width in 1_usize..24, channels in prop::sample::select(vec![1_usize, 3, 4]),
        seed in any::<u64>(), episode in any::<u64>(), level in 0.0..=1.0_f64,
        border in prop::sample::select(vec![Border::Repeat, Border::Constant(0.3)]),
        fill in prop::sample::select(vec![Fill::Constant(0.6), Fill::Mean, Fill::Noise]),
    ) {
        let shape = Shape::new(height, width, channels).unwrap();
        let images = bytes(shape.values(), seed);
        let floats: Vec<f32> = images.iter().map(|byte| f32::from(*byte) / 255.0).collect();
        let ranges = Ranges::plausible().filled_with(fill).unwrap().bordered_by(border).unwrap();
        let ranges = ranges.with("lens", "k2", [-1.0, 1.0]).unwrap().at_level(level).unwrap();
        let index = [ImageIndex { episode, frame: 3 }];
        let of_bytes = randomized(&ranges, &images, shape, &index);
        let of_floats = randomized(&ranges, &floats, shape, &index);
        // The mean of rounded values may be off by the half of a value more.
        let rounding = if fill == Fill::Mean { 1.01 } else { 0.51 };
        for (byte, float) in of_bytes.iter().zip(&of_floats) {
            prop_assert!((0.0..=1.0).contains(float));
            prop_assert!((f32::from(*byte) - 255.0 * float).abs() <= rounding, "{} {}", byte, float);
        }
        prop_assert_eq!(randomized(&ranges, &images, shape, &index), of_bytes);
    }

    /// A picture of one colour stays one without noise and occlusion, whatever lens, shift and blur do.
    #[test]
    fn one_colour_stays_one(value in any::<u8>(), height in 1_usize..12, width in 1_usize..12, episode in any::<u64>()) {
        let shape = Shape::new(height, width, 3).unwrap();
        let ranges = Ranges::plausible().without("noise").unwrap().without("occlusion").unwrap();
        let out = randomized(&ranges, &vec![value; shape.values()], shape, &[ImageIndex { episode, frame: 0 }]);
        prop_assert!(out.chunks(3).all(|pixel| pixel == &out[..3]));
    }
}
