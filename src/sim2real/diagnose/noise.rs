//! The noise floor: how far a measurement would scatter if nothing moved.

use crate::sim2real::{ChannelWeight, Clock, Measured, Recording, Simulator};

/// A noise is taken for at least this part of its channel's spread: below, rounding of the arithmetic decides.
const SMALLEST: f64 = 1e-7;

/// The noise of every channel that is both measured and simulated.
#[must_use]
pub fn channel_weights<S: Simulator>(simulator: &S, recordings: &[Recording<S::Stimulus>]) -> Vec<ChannelWeight> {
    simulator
        .channels()
        .iter()
        .filter_map(|channel| {
            let measured: Vec<(&Recording<S::Stimulus>, &Measured)> =
                recordings.iter().filter_map(|r| Some((r, r.channel(&channel.name)?))).collect();
            // A channel that never moves says nothing of its noise, nor of anything else.
            let floors: Vec<f64> = measured.iter().map(|(r, m)| floor(simulator, r, m)).filter(|f| *f > 0.0).collect();
            (!floors.is_empty()).then(|| ChannelWeight { channel: channel.name.to_string(), noise: median(floors) })
        })
        .collect()
}

fn floor<S: Simulator>(simulator: &S, recording: &Recording<S::Stimulus>, measured: &Measured) -> f64 {
    let present: Vec<f64> = measured.samples.iter().flatten().copied().collect();
    let rounding = simulator.resolution(recording, &measured.channel);
    let scatter = match simulator.clock() {
        Clock::Sampled { .. } => scatter(&recording.time, &measured.samples),
        // Messages are no samples of one signal: differences of those that follow each other say nothing of their noise.
        Clock::Event => simulator.scatter(recording, &measured.channel),
    };
    let mean = present.iter().sum::<f64>() / present.len().max(1) as f64;
    let spread = (present.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / present.len().max(1) as f64).sqrt();
    let moves = spread > 0.0 || simulator.clock() == Clock::Event;
    if moves && !present.is_empty() { scatter.max(rounding).max(SMALLEST * spread) } else { 0.0 }
}

/// Standard deviation of white noise on a smooth signal, from the median absolute fourth difference.
///
/// Differencing removes polynomials up to the third degree; white noise of variance 1 leaves a variance of
/// 1 + 16 + 36 + 16 + 1 = 70. Source: the difference-based estimators of Hall, Kay & Titterington, Biometrika 77 (1990).
pub(super) fn fourth_difference(samples: &[Option<f64>]) -> f64 {
    let differences: Vec<f64> = samples
        .windows(5)
        .filter_map(|w| match w {
            [Some(a), Some(b), Some(c), Some(d), Some(e)] => Some((a - 4.0 * b + 6.0 * c - 4.0 * d + e).abs()),
            _ => None,
        })
        .collect();
    if differences.is_empty() { 0.0 } else { median(differences) / 0.674_489_75 / 70.0_f64.sqrt() }
}

/// The same of samples of which hardly any five are next to each other: by the fourth divided differences of those that are there, of
/// which the motion itself makes the larger ones.
fn scatter(time: &[f64], samples: &[Option<f64>]) -> f64 {
    let next_to_each_other = fourth_difference(samples);
    if next_to_each_other > 0.0 {
        return next_to_each_other;
    }
    let present: Vec<[f64; 2]> = time.iter().zip(samples).filter_map(|(t, y)| Some([*t, (*y)?])).collect();
    let mut differences: Vec<f64> = present.windows(FIVE).map(divided_difference).filter(|d| d.is_finite()).collect();
    if differences.is_empty() {
        return 0.0;
    }
    differences.sort_by(f64::total_cmp);
    // The first quartile of what is left of white noise alone.
    differences[differences.len() / 4] / 0.318_639_36
}

/// Samples of a fourth difference.
const FIVE: usize = 5;

/// The fourth divided difference of samples at any times, of variance 1 for white noise of variance 1.
fn divided_difference(points: &[[f64; 2]]) -> f64 {
    let weight = |k: usize| -> f64 {
        points.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, [t, _])| 1.0 / (points[k][0] - t)).product()
    };
    let (sum, squares) = points.iter().enumerate().fold((0.0, 0.0), |(sum, squares), (k, [_, y])| {
        let weight = weight(k);
        (sum + weight * y, squares + weight * weight)
    });
    (sum / squares.sqrt()).abs()
}

/// The median; the values need not be sorted, but there must be one.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() {
        0 => 0.0,
        n if n % 2 == 1 => values[half],
        _ => 0.5 * (values[half - 1] + values[half]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use rand_distr::{Distribution, StandardNormal};

    #[test]
    fn finds_the_noise_under_a_moving_signal() {
        let mut rng = Seed(3).stream("noise");
        let samples: Vec<Option<f64>> = (0..4_000)
            .map(|i| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                Some((f64::from(i) * 0.01).sin() + 0.002 * noise)
            })
            .collect();
        assert!((fourth_difference(&samples) - 0.002).abs() < 1e-4);
    }

    #[test]
    fn finds_the_noise_of_samples_that_are_far_apart() {
        let mut rng = Seed(4).stream("noise");
        let time: Vec<f64> = (0..9_000).map(|i| f64::from(i) * 0.01).collect();
        // Two of three samples are lost, and now and then one more.
        let samples: Vec<Option<f64>> = (0..9_000)
            .map(|i| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                (i % 3 == 0 && i % 33 != 0).then_some((f64::from(i) * 0.01).sin() + 0.002 * noise)
            })
            .collect();
        assert_eq!(fourth_difference(&samples), 0.0, "no five are next to each other");
        assert!((scatter(&time, &samples) - 0.002).abs() < 2e-4, "{}", scatter(&time, &samples));
        assert_eq!(scatter(&time[..12], &samples[..12]), 0.0, "nor are there five");
    }
}
