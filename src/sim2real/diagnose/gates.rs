//! Gates: whether integration is fine enough for what the recordings can tell.

use super::evidence::Evidence;
use crate::sim2real::identify::Problem;
use crate::sim2real::{Clock, Part, Seed, Simulator, Twin};

/// Halving the step of integration may move the output by this part of the noise, or the step is too long: a delay or a lag
/// would be named for it.
const TOLERATED: f64 = 0.1;

/// What was selected with longer steps may move by this part of the noise when followed with the simulator's own; beyond,
/// the selection is made anew.
pub(super) const SETTLED: f64 = 1.0;

/// The longest step [s] with which hypotheses may be compared: the rows' own spacing, or a part of it, as long as halving
/// it does not matter. None where only the simulator's own step will do.
pub(super) fn exploring_step<T: Twin>(twin: &T, theta: &[f64], evidence: &Evidence<'_, T::Stimulus>) -> Option<f64> {
    let Clock::Sampled { longest_step } = twin.clock() else { return None };
    let mut step = spacing(&evidence.free_run)?;
    // Steps of less than twice the simulator's own save nothing.
    while step > 1.9 * longest_step {
        if moved(twin, theta, evidence, step, 0.5 * step) <= TOLERATED {
            return Some(step);
        }
        step *= 0.5;
    }
    None
}

/// By how much the output at `theta` moves when steps of `coarse` [s] become steps of `fine` [s]: root mean square, in
/// units of the noise, of the channel in which it is most.
pub(super) fn moved<T: Twin>(twin: &T, theta: &[f64], evidence: &Evidence<'_, T::Stimulus>, coarse: f64, fine: f64) -> f64 {
    let follow = |step: f64| {
        let simulator = twin.stepping(step);
        let problem =
            Problem { simulator: &simulator, parts: &evidence.compared, weights: &evidence.weights, seed: Seed(0) };
        let evaluation = problem.evaluate(theta, &evidence.initial_state(&problem), &[]);
        (evaluation.residual.rows(0, evaluation.measured).into_owned(), problem.blocks())
    };
    let ((coarse, blocks), (fine, _)) = (follow(coarse), follow(fine));
    evidence
        .weights
        .iter()
        .map(|weight| {
            let own = blocks.iter().filter(|b| b.channel == weight.channel).flat_map(|b| b.range.clone());
            let (sum, count) = own.fold((0.0, 0), |(sum, count), i| (sum + (coarse[i] - fine[i]).powi(2), count + 1));
            (sum / f64::from(count.max(1))).sqrt()
        })
        .fold(0.0, f64::max)
}

/// Median distance of rows [s].
fn spacing<S>(parts: &[Part<'_, S>]) -> Option<f64> {
    let mut all: Vec<f64> =
        parts.iter().flat_map(|p| p.recording.time[p.rows.clone()].windows(2).map(|w| w[1] - w[0])).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// Longest step of integration a simulator takes by itself [s].
pub(super) fn own_step<T: Simulator>(simulator: &T) -> f64 {
    match simulator.clock() {
        Clock::Sampled { longest_step } => longest_step,
        Clock::Event => 0.0,
    }
}
