//! What a diagnosis may look at: the parts that are fitted, the parts that are held out, and how they are followed.

use super::noise::channel_weights;
use crate::sim2real::identify::{Problem, State};
use crate::sim2real::{ChannelWeight, Clock, Part, Recording, Seed, Simulator, Thetas, Twin};

/// Part of each recording that is held out where no recording is given for that.
pub const HELD_OUT: f64 = 0.3;

/// A start's memory longer than this part of it, at the end of a recording, means that errors add up.
const REMEMBERED: f64 = 0.5;

/// Windows in which an accumulating plant is followed, in time constants of the plant.
const WINDOW: f64 = 2.0;

/// Windows into which a recording is cut at the most: each has an initial state of its own to be paid for.
const MOST_WINDOWS: f64 = 40.0;

/// A window longer than this part of a recording starts afresh so seldom that it shows what a free run shows.
const LONGEST_WINDOW: f64 = 0.5;

/// Rows of each held-out recording, as a part of it, from which its initial state is estimated.
const SETTLING: f64 = 0.1;

/// Recordings, divided.
#[derive(Debug)]
pub struct Evidence<'a, S> {
    /// What is fitted, followed from the start of each recording.
    pub free_run: Vec<Part<'a, S>>,
    /// What hypotheses are compared on: the same rows, in windows where the plant adds up errors.
    pub compared: Vec<Part<'a, S>>,
    /// What no fit sees.
    pub held_out: Vec<Part<'a, S>>,
    /// How it was held out, in words.
    pub how: String,
    /// Noise of every channel.
    pub weights: Vec<ChannelWeight>,
    /// Variance of each channel's rounding, in units of its noise: no fit is taken for better than that.
    pub rounding: Vec<f64>,
    /// Length of the windows [s], where there are any.
    pub window: Option<f64>,
    /// Whether rows are few and far between, each of which tells as much as many: those next to the start of a part say nothing of it,
    /// and noise has forgotten itself from one to the next.
    pub sparse: bool,
}

impl<'a, S: Send + Sync> Evidence<'a, S> {
    /// Divides `recordings`: the last [`HELD_OUT`] of each is held out, unless there are recordings `held_out` for that.
    #[must_use]
    pub fn divide<T: Simulator<Stimulus = S>>(
        simulator: &T,
        recordings: &'a [Recording<S>],
        held_out: &'a [Recording<S>],
    ) -> Self {
        let (free_run, apart, how): (Vec<Part<'a, S>>, Vec<Part<'a, S>>, String) = if held_out.is_empty() {
            let (fit, rest) = recordings.iter().map(|r| Part::split(r, 1.0 - HELD_OUT)).unzip();
            (fit, rest, format!("the last {:.0} % in time of each recording", HELD_OUT * 100.0))
        } else {
            let names: Vec<&str> = held_out.iter().map(|r| r.name.as_str()).collect();
            let whole = |all: &'a [Recording<S>]| all.iter().map(Part::whole).collect();
            (whole(recordings), whole(held_out), format!("recordings of their own: {}", names.join(", ")))
        };
        let weights = channel_weights(simulator, recordings);
        let rounding = weights
            .iter()
            .map(|w| {
                let sum: f64 = recordings.iter().map(|r| (simulator.resolution(r, &w.channel) / w.noise).powi(2)).sum();
                sum / recordings.len().max(1) as f64
            })
            .collect();
        let window = window(simulator, &free_run);
        let compared = match window {
            Some(seconds) => free_run.iter().flat_map(|p| p.windows(seconds)).collect(),
            None => free_run.clone(),
        };
        Self { free_run, compared, held_out: apart, how, weights, rounding, window, sparse: false }
    }

    /// The same evidence, in which hypotheses are compared in free run whatever the plant is.
    pub(super) fn in_free_run(&self) -> Self {
        Self {
            free_run: self.free_run.clone(),
            compared: self.free_run.clone(),
            held_out: self.held_out.clone(),
            how: self.how.clone(),
            weights: self.weights.clone(),
            rounding: self.rounding.clone(),
            window: None,
            sparse: self.sparse,
        }
    }

    /// What was held out, as if it were there to be fitted.
    pub(super) fn of_held_out(&self) -> Self {
        let held_out = || self.held_out.clone();
        Self { free_run: held_out(), compared: held_out(), held_out: Vec::new(), ..self.in_free_run() }
    }

    /// The same evidence, in which hypotheses are compared on windows that start afresh, into so many of which the longest part is cut.
    pub(super) fn in_windows(&self, count: f64) -> Self {
        let lasts = |part: &Part<'_, S>| {
            let time = &part.recording.time[part.rows.clone()];
            time.last().unwrap_or(&0.0) - time.first().unwrap_or(&0.0)
        };
        let seconds = self.free_run.iter().map(lasts).fold(0.0, f64::max) / count;
        let compared = self.free_run.iter().flat_map(|p| p.windows(seconds)).collect();
        Self { compared, window: Some(seconds), ..self.in_free_run() }
    }

    /// Variance of the rounding of `channel`, in units of its noise.
    pub(super) fn rounding_of(&self, channel: &str) -> f64 {
        self.weights.iter().position(|w| w.channel == channel).map_or(0.0, |k| self.rounding[k])
    }

    /// What is held out, divided as what is compared.
    pub(super) fn held_out_as_compared(&self) -> Vec<Part<'a, S>> {
        match self.window {
            Some(seconds) => self.held_out.iter().flat_map(|part| part.windows(seconds)).collect(),
            None => self.held_out.clone(),
        }
    }

    /// The initial states with which parts are compared: windows start wherever fits best.
    pub(super) fn initial_state<T: Simulator<Stimulus = S>>(&self, problem: &Problem<'_, T>) -> State {
        if self.window.is_some() || self.sparse { State::unknown(problem) } else { State::estimated(problem) }
    }

    /// The state from which a simulator at `theta` best starts a held-out part: estimated from the rows before it where a
    /// run passes through them, from its first rows elsewhere.
    pub(super) fn settled<T: Twin<Stimulus = S>>(&self, simulator: &T, theta: &[f64], part: &Part<'a, S>) -> Vec<f64> {
        settled(simulator, theta, part, &self.weights)
    }
}

/// The state from which a simulator at `theta` best starts `part`: estimated from the rows before it where a run passes through
/// them, from its first rows elsewhere. The noise of each channel is that of `weights`.
#[must_use]
pub fn settled<T: Twin>(simulator: &T, theta: &[f64], part: &Part<'_, T::Stimulus>, weights: &[ChannelWeight]) -> Vec<f64> {
    let simulator = &simulator.rounding(false);
    let end = if part.rows.start > part.start {
        part.rows.start
    } else {
        let rows = part.rows.len();
        part.start + ((rows as f64 * SETTLING) as usize).clamp(20.min(rows), rows)
    };
    let first = [Part { recording: part.recording, start: part.start, rows: part.start..end }];
    let problem = Problem { simulator, parts: &first, weights, seed: Seed(0) };
    let mut state = State::estimated(&problem);
    for _ in 0..3 {
        let evaluation = problem.evaluate(theta, &state, &[]);
        let rows = evaluation.residual.len().max(1) as f64;
        state.misfit = (evaluation.residual.norm_squared() / rows).sqrt().max(1.0);
        for (value, step) in state.values[0].iter_mut().zip(&evaluation.initial_step[0]) {
            *value += step;
        }
    }
    state.values.swap_remove(0)
}

/// How long windows must be [s] for a plant that never forgets where it started: there, a free run adds up all errors
/// and its residuals hold hardly any independent evidence. None for a plant that forgets, nor where windows would be longer
/// than [`LONGEST_WINDOW`] of what was recorded.
fn window<S: Simulator>(simulator: &S, parts: &[Part<'_, S::Stimulus>]) -> Option<f64> {
    if simulator.clock() == Clock::Event {
        return None;
    }
    let part = parts.first()?;
    let initial = simulator.initial_parameters(part.recording, part.start);
    let base: Vec<f64> = simulator
        .parameters()
        .iter()
        .chain(&initial)
        .map(|p| if p.nominal.is_finite() { p.nominal } else { f64::MAX })
        .collect();
    let count = simulator.parameters().len();
    let moved = |k: usize| {
        let mut lane = base.clone();
        lane[count + k] += 1e-3 * initial[k].scale();
        lane
    };
    let lanes: Vec<Vec<f64>> = std::iter::once(base.clone()).chain((0..initial.len()).map(moved)).collect();
    let runs = simulator.rollout(&Thetas::from_lanes(&lanes), part.recording, part.followed(), Seed(0));
    let distance = |k: usize, row: usize| (runs[k].first().map_or(0.0, |s| s.samples[row]) - runs[0][0].samples[row]).abs();
    let last = part.followed().len().checked_sub(1)?;
    let forgotten = initial.is_empty() || distance(1, last) < REMEMBERED * distance(1, 0);
    if forgotten {
        return None;
    }
    // A push of the velocity carries an accumulating plant to a new place within its time constant.
    let time = &part.recording.time[part.followed()];
    let reach = distance(initial.len(), last) * (1.0 - (-1.0_f64).exp());
    let row = (0..=last).find(|row| distance(initial.len(), *row) >= reach)?;
    let constant = time[row] - time[0];
    let duration = time[last] - time[0];
    let window = (WINDOW * constant).max(20.0 * duration / last.max(1) as f64).max(duration / MOST_WINDOWS);
    (window <= LONGEST_WINDOW * duration).then_some(window)
}
