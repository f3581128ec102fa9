//! What comes and goes at a frequency of its own: a line in the spectrum of what is left, at the same place in every recording, however
//! each was moved. Nothing that a plant does by itself keeps time so well.

use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

use super::Comparison;
use super::words::figure;
use crate::sim2real::Clock;

/// A line stands this many times above the spectrum on either side of it, ...
const STANDS_OUT: f64 = 20.0;
/// ... and is at least this part of what is left.
const PART: f64 = 0.05;
/// Cells of the spectrum, of one over the duration each: those that a line fills on either side of its middle, and those that the
/// spectrum beside it is taken of.
const OF_LINE: usize = 2;
const BESIDE: std::ops::Range<usize> = 3..15;
/// Rows are evenly spaced to within this part of a step.
const EVENLY: f64 = 0.1;

/// A line in a spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    /// [Hz].
    frequency: f64,
    /// Width of a cell [Hz].
    cell: f64,
}

/// In words, what is left of some channel swings at in all recordings, those held out too; none where nothing does.
///
/// Source: the test of the largest ordinate of a periodogram, Fisher, Proc. R. Soc. A 125 (1929), against the spectrum about it, as lines
/// are told from coloured noise in Percival & Walden, *Spectral Analysis for Physical Applications* (1993), chapter 10.
pub(super) fn swing(comparisons: &[Comparison]) -> Option<String> {
    let mut channels: Vec<&str> = comparisons.iter().map(|c| c.channel.as_str()).collect();
    channels.sort_unstable();
    channels.dedup();
    channels.into_iter().find_map(|channel| {
        let own: Vec<&Comparison> = comparisons.iter().filter(|c| c.channel == channel).collect();
        // What no other recording confirms may be how this one was moved.
        if !own.iter().any(|c| c.held_out) || own.iter().all(|c| c.held_out) {
            return None;
        }
        let mut lines = own.iter().map(|c| lines(c));
        let first = lines.next()?;
        let all = lines.fold(first, |kept, lines| {
            let same = |a: &Line| lines.iter().any(|b| (a.frequency - b.frequency).abs() < a.cell.max(b.cell));
            kept.into_iter().filter(same).collect()
        });
        let frequency = all.first()?.frequency;
        Some(format!(
            "what is left of {channel} swings at {} Hz in every recording, those held out too, however they were moved",
            figure(frequency, 3)
        ))
    })
}

/// The lines in what the trued twin leaves, the strongest first.
fn lines(comparison: &Comparison) -> Vec<Line> {
    let Some(step) = even_step(&comparison.time).filter(|_| comparison.clock != Clock::Event) else { return Vec::new() };
    let pairs = || comparison.measured.iter().zip(&comparison.trued);
    let known = pairs().filter_map(|(measured, trued)| Some((*measured)? - trued)).filter(|r| r.is_finite());
    let (sum, count) = known.fold((0.0, 0.0), |(sum, count), r| (sum + r, count + 1.0));
    let mean = sum / f64::max(count, 1.0);
    // What was lost is as much as the mean: nothing.
    let left = pairs()
        .map(|(measured, trued)| measured.map_or(0.0, |m| m - trued - mean))
        .map(|r| if r.is_finite() { r } else { 0.0 });
    of_series(&left.collect::<Vec<_>>(), step)
}

/// The step between rows; none where they are not evenly spaced, or hardly any.
fn even_step(time: &[f64]) -> Option<f64> {
    let steps = || time.windows(2).map(|pair| pair[1] - pair[0]);
    let step = (time.last()? - time.first()?) / (time.len().checked_sub(1)? as f64);
    (step > 0.0 && steps().all(|own| (own - step).abs() <= EVENLY * step)).then_some(step)
}

fn of_series(left: &[f64], step: f64) -> Vec<Line> {
    if left.len() < 8 * BESIDE.end {
        return Vec::new();
    }
    let power = spectrum(left);
    let whole: f64 = power.iter().sum();
    // Padded with nothing to twice the length and more, a cell is so many numbers wide.
    let size = 2 * (power.len() - 1);
    let cell = size / left.len();
    let beside = |cells: &mut dyn Iterator<Item = usize>| -> f64 {
        let mut own: Vec<f64> = cells.map(|k| power[k]).collect();
        own.sort_by(f64::total_cmp);
        own[own.len() / 2] / std::f64::consts::LN_2
    };
    let far = BESIDE.start * cell..BESIDE.end * cell;
    let mut found: Vec<(f64, Line)> = Vec::new();
    for k in far.start..power.len().saturating_sub(far.end) {
        if power[k] < power[k - 1] || power[k] < power[k + 1] || power[k] * (2 * OF_LINE * cell + 1) as f64 <= PART * whole {
            continue;
        }
        // Below its own frequency the spectrum may have fewer cells.
        let below = beside(&mut far.clone().map_while(|d| k.checked_sub(d)));
        let background = below.max(beside(&mut far.clone().map(|d| k + d)));
        let line: f64 = (k - OF_LINE * cell..=k + OF_LINE * cell).map(|j| (power[j] - background).max(0.0)).sum();
        if power[k] > STANDS_OUT * background && line > PART * whole {
            let wide = 1.0 / (left.len() as f64 * step);
            found.push((line, Line { frequency: k as f64 / (size as f64 * step), cell: wide }));
        }
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.into_iter().map(|(_, line)| line).collect()
}

/// The power of a series under Hann's window, from frequency 0 to half that of the rows.
fn spectrum(series: &[f64]) -> Vec<f64> {
    let size = (2 * series.len()).next_power_of_two();
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(size);
    let mut padded = transform.make_input_vec();
    let turn = std::f64::consts::TAU / series.len() as f64;
    for (k, (to, value)) in padded.iter_mut().zip(series).enumerate() {
        *to = value * 0.5 * (1.0 - (turn * (k as f64 + 0.5)).cos());
    }
    let mut spectrum = transform.make_output_vec();
    // Its lengths are those it asked for.
    let _ = transform.process(&mut padded, &mut spectrum);
    spectrum.iter().map(Complex::norm_sqr).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sim2real::Seed;
    use rand_distr::{Distribution, StandardNormal};

    /// What is left in a recording of 5,000 rows at 4 ms: noise that keeps `part` of itself, and a swing.
    fn recording(seed: u64, held_out: bool, part: f64, swing: impl Fn(f64) -> f64) -> Comparison {
        let mut rng = Seed(seed).stream(if held_out { "test" } else { "train" });
        let mut last = 0.0;
        let time: Vec<f64> = (0..5_000).map(|row| 0.004 * f64::from(row)).collect();
        let measured = time.iter().map(|t| {
            let fresh: f64 = StandardNormal.sample(&mut rng);
            last = part * last + (1.0 - part * part).sqrt() * fresh;
            Some(5.0 + last + swing(*t))
        });
        let measured = measured.collect();
        let trued = vec![5.0; 5_000];
        let clock = Clock::Sampled { longest_step: 0.004 };
        Comparison {
            recording: "r".into(),
            held_out,
            clock,
            channel: "position".into(),
            unit: "rad".into(),
            time,
            measured,
            nominal: trued.clone(),
            recalibrated: trued.clone(),
            trued,
        }
    }

    fn at(frequency: f64) -> impl Fn(f64) -> f64 {
        move |t| 0.5 * (std::f64::consts::TAU * frequency * t + 1.0).sin()
    }

    #[test]
    fn a_swing_is_told_where_both_recordings_have_it_and_rows_that_were_lost_do_not_hide_it() {
        let mut both = [recording(1, false, 0.7, at(1.37)), recording(1, true, 0.7, at(1.37))];
        both[0].measured.iter_mut().step_by(9).for_each(|row| *row = None);
        let told = swing(&both).unwrap();
        assert!(told.contains("position swings at 1.3"), "{told}");
        assert_eq!(swing(&[recording(1, false, 0.7, at(1.37)), recording(1, true, 0.7, at(2.2))]), None);
        assert_eq!(swing(&[recording(1, false, 0.7, at(1.37)), recording(1, true, 0.7, |_| 0.0)]), None);
        assert_eq!(swing(&both[..1]), None, "nothing confirms it");
    }

    #[test]
    fn noise_of_any_colour_and_what_drifts_have_no_line() {
        for seed in 0..40 {
            for part in [0.0, 0.6, 0.95, 0.99] {
                let both = [recording(seed, false, part, |_| 0.0), recording(seed, true, part, |_| 0.0)];
                assert_eq!(swing(&both), None, "seed {seed}, {part} of the row before");
            }
        }
        let creeps = |t: f64| 2.0 * (-t / 5.0).exp();
        assert_eq!(swing(&[recording(1, false, 0.0, creeps), recording(1, true, 0.0, creeps)]), None);
    }

    #[test]
    fn too_few_rows_and_uneven_ones_have_none() {
        assert_eq!(even_step(&[]), None);
        assert_eq!(even_step(&[1.0]), None);
        assert_eq!(even_step(&[0.0, 0.1, 0.3]), None);
        assert_eq!(even_step(&[0.0, 0.1, 0.2]), Some(0.1));
        assert!(of_series(&[1.0; 20], 0.1).is_empty());
        assert!(of_series(&[0.0; 400], 0.1).is_empty());
    }
}
