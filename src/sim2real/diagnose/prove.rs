//! Proof: errors on data no fit has seen, and placebos that must fail.

use nalgebra::DVector;
use rand::Rng;
use rayon::prelude::*;

use super::evidence::Evidence;
use super::hypothesis::{Hypothesis, Inquiry};
use super::{ChannelFit, Comparison};
use crate::sim2real::identify::Fit;
use crate::sim2real::{ChannelWeight, Part, Seed, Simulator, Thetas, Twin};

/// Draws of the block bootstrap.
const DRAWS: usize = 1_000;
/// Placebos tried.
const PLACEBOS: usize = 199;

/// The three twins, each at its values.
pub(super) struct Contest<'a, T> {
    pub nominal: (&'a T, &'a [f64]),
    pub recalibrated: (&'a T, &'a [f64]),
    pub trued: (&'a T, &'a [f64]),
}

/// Follows every part with all three twins, channel by channel.
pub(super) fn compared<T: Twin>(
    contest: &Contest<'_, T>,
    evidence: &Evidence<'_, T::Stimulus>,
    seed: Seed,
) -> Vec<Comparison> {
    let parts: Vec<(&Part<'_, T::Stimulus>, bool)> =
        evidence.free_run.iter().map(|p| (p, false)).chain(evidence.held_out.iter().map(|p| (p, true))).collect();
    parts
        .par_iter()
        .map(|(part, held_out)| {
            let run = |(twin, theta): (&T, &[f64])| {
                let state = evidence.settled(twin, theta, part);
                let lane: Vec<f64> = theta.iter().chain(&state).copied().collect();
                twin.rounding(true).rollout(&Thetas::single(&lane), part.recording, part.followed(), seed).swap_remove(0)
            };
            let runs = [run(contest.nominal), run(contest.recalibrated), run(contest.trued)];
            evidence.weights.iter().filter_map(|w| comparison(part, *held_out, w, &runs, contest.trued.0)).collect()
        })
        .collect::<Vec<Vec<Comparison>>>()
        .into_iter()
        .flatten()
        .collect()
}

fn comparison<S, T: Simulator>(
    part: &Part<'_, S>,
    held_out: bool,
    weight: &ChannelWeight,
    runs: &[crate::sim2real::Trajectory; 3],
    simulator: &T,
) -> Option<Comparison> {
    let measured = part.recording.channel(&weight.channel)?;
    let of = |k: usize| {
        let simulated = runs[k].iter().find(|s| s.channel == weight.channel)?;
        Some(simulated.samples[part.rows.start - part.start..].to_vec())
    };
    Some(Comparison {
        recording: part.recording.name.clone(),
        held_out,
        clock: simulator.clock(),
        channel: weight.channel.clone(),
        unit: measured.unit.clone(),
        time: part.recording.time[part.rows.clone()].to_vec(),
        measured: measured.samples[part.rows.clone()].to_vec(),
        nominal: of(0)?,
        recalibrated: of(1)?,
        trued: of(2)?,
    })
}

/// Errors of every channel on the held-out parts.
pub(super) fn channel_fits(comparisons: &[Comparison], weights: &[ChannelWeight], seed: Seed) -> Vec<ChannelFit> {
    weights.iter().filter_map(|w| channel_fit(comparisons, w, seed)).collect()
}

fn channel_fit(comparisons: &[Comparison], weight: &ChannelWeight, seed: Seed) -> Option<ChannelFit> {
    let held: Vec<&Comparison> = comparisons.iter().filter(|c| c.held_out && c.channel == weight.channel).collect();
    let errors = |of: fn(&Comparison) -> &[f64]| -> Vec<f64> {
        held.iter().flat_map(|c| c.measured.iter().zip(of(c)).filter_map(|(m, s)| m.map(|m| m - s))).collect()
    };
    let (nominal, recalibrated, trued) = (errors(|c| &c.nominal), errors(|c| &c.recalibrated), errors(|c| &c.trued));
    let unit = held.first()?.unit.clone();
    (!trued.is_empty()).then(|| ChannelFit {
        channel: weight.channel.clone(),
        unit,
        noise_floor: weight.noise,
        nominal_rmse: told(root_mean_square(&nominal)),
        recalibrated_rmse: told(root_mean_square(&recalibrated)),
        trued_rmse: told(root_mean_square(&trued)),
        nominal_mae: told(mean_absolute(&nominal)),
        recalibrated_mae: told(mean_absolute(&recalibrated)),
        trued_mae: told(mean_absolute(&trued)),
        improvement_ci95: improvement(&recalibrated, &trued, seed),
    })
}

/// An error, which has no bound where the run has left all bounds, be that by infinity or by no number at all.
fn told(error: f64) -> f64 {
    if error.is_nan() { f64::INFINITY } else { error }
}

fn root_mean_square(errors: &[f64]) -> f64 {
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}

fn mean_absolute(errors: &[f64]) -> f64 {
    errors.iter().map(|e| e.abs()).sum::<f64>() / errors.len().max(1) as f64
}

/// 95 % interval of `1 - rmse(trued) / rmse(recalibrated)` by a moving-block bootstrap (Künsch, Annals of Statistics 17
/// (1989)): blocks of neighbouring rows are drawn together, so that errors which go together stay together.
fn improvement(recalibrated: &[f64], trued: &[f64], seed: Seed) -> [f64; 2] {
    let count = trued.len();
    let time = super::whiteness::autocorrelation_time(&[recalibrated]);
    let block = ((2.0 * time).ceil() as usize).clamp(1, (count / 8).max(1));
    let mut rng = seed.stream("bootstrap");
    let cumulated = |errors: &[f64]| -> Vec<f64> {
        std::iter::once(0.0)
            .chain(errors.iter().scan(0.0, |sum, e| {
                *sum += e * e;
                Some(*sum)
            }))
            .collect()
    };
    let (before, after) = (cumulated(recalibrated), cumulated(trued));
    // A run that leaves all bounds is better or worse without measure.
    match [&before, &after].map(|sums| sums.last().is_some_and(|sum| sum.is_finite())) {
        [true, true] => {}
        [true, false] => return [f64::NEG_INFINITY; 2],
        [false, true] => return [1.0; 2],
        [false, false] => return [0.0; 2],
    }
    let mut draws: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let (mut a, mut b) = (0.0, 0.0);
            for _ in 0..count.div_ceil(block) {
                let at = rng.next_u64() as usize % (count - block + 1);
                a += before[at + block] - before[at];
                b += after[at + block] - after[at];
            }
            if a > 0.0 { 1.0 - (b / a).sqrt() } else { 0.0 }
        })
        .collect();
    draws.sort_by(f64::total_cmp);
    [draws[DRAWS / 40], draws[DRAWS - 1 - DRAWS / 40]]
}

/// The share of placebos that look at least as much like the misfit as what was named does: the misfit is moved around
/// in time (orders: dealt out anew), so that nothing it has to do with its causes is left.
pub(super) fn placebo<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    without: &[Hypothesis<T>],
    selected: &Hypothesis<T>,
) -> Option<f64> {
    let worst = without.iter().map(|less| one_placebo(inquiry, less, &selected.fit));
    worst.reduce(f64::max)
}

/// Placebos of one mechanism: what leaving it out changes in the residuals, against that change shifted.
fn one_placebo<T: Twin>(inquiry: &Inquiry<'_, T>, less: &Hypothesis<T>, whole: &Fit) -> f64 {
    let blocks = inquiry.problem(&less.twin, &inquiry.evidence.compared).blocks();
    let rows = blocks.last().map_or(0, |b| b.range.end);
    let misfit: DVector<f64> = less.fit.residual.rows(0, rows).into_owned();
    let change: DVector<f64> = &misfit - whole.residual.rows(0, rows);
    let actual = misfit.dot(&change).abs();
    let mut rng = inquiry.seed.stream("placebo");
    let at_least = (0..PLACEBOS)
        .filter(|_| {
            let shift = rows / 20 + rng.next_u64() as usize % (rows - rows / 10).max(1);
            let flip = if inquiry.twin.clock() == crate::sim2real::Clock::Event { rng.next_u64() } else { 0 };
            let placebo: f64 = (0..rows)
                .map(|i| {
                    let sign = if flip.rotate_left(i as u32) & 1 == 1 { -1.0 } else { 1.0 };
                    sign * misfit[(i + shift) % rows] * change[i]
                })
                .sum();
            placebo.abs() >= actual
        })
        .count();
    (1.0 + at_least as f64) / (1.0 + PLACEBOS as f64)
}
