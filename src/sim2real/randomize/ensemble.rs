//! A recording followed by many draws of a twin.

use rayon::prelude::*;

use crate::sim2real::any_twin::{AnyStimulus, AnyTwin, any_recording};
use crate::sim2real::diagnose::{channel_weights, settled};
use crate::sim2real::{Measured, Part, Recording, Seed, Simulator, Thetas, Trajectory, Twin};

/// One channel of a recording, as a twin and its draws foretell it.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// Name of the recording.
    pub recording: String,
    /// The channel.
    pub channel: String,
    /// Its unit.
    pub unit: String,
    /// Times [s].
    pub time: Vec<f64>,
    /// What was measured; none where a sample was lost.
    pub measured: Vec<Option<f64>>,
    /// Standard deviation of the measurement noise, in `unit`.
    pub noise: f64,
    /// What the twin as it is given says.
    pub nominal: Vec<f64>,
    /// What each draw says; draws that leave all bounds are not here.
    pub draws: Vec<Vec<f64>>,
    /// How many of the draws left all bounds.
    pub diverged: usize,
}

/// Draws followed side by side.
const LANES: usize = 16;

/// Follows `recording` by `twin` at `nominal` and at each of `lanes`, values of all of its parameters; gives the channels that were
/// measured and move.
///
/// Each draw starts from the state from which it fits the first rows best, as in a diagnosis: a state belongs to a recording, and
/// is not known from it to better than the noise. What is random stays out: the noise floor, of `recording` itself, stands for it.
/// Every draw has the same seed, so that draws differ by their parameters and by nothing else, however many there are.
/// `tell` is told how many are done.
#[must_use]
pub fn ensemble<T: Twin>(
    twin: &T,
    nominal: &[f64],
    lanes: &[Vec<f64>],
    recording: &Recording<T::Stimulus>,
    seed: Seed,
    tell: &(dyn Fn(usize) + Sync),
) -> Vec<Predicted> {
    predicted(&AnyTwin::new(twin.quiet()), nominal, lanes, &any_recording(recording.clone()), seed, tell)
}

/// The same of a twin of any kind, which draws nothing itself.
fn predicted(
    quiet: &AnyTwin,
    nominal: &[f64],
    lanes: &[Vec<f64>],
    recording: &Recording<AnyStimulus>,
    seed: Seed,
    tell: &(dyn Fn(usize) + Sync),
) -> Vec<Predicted> {
    let part = Part::whole(recording);
    let weights = channel_weights(quiet, std::slice::from_ref(recording));
    let followed = |some: &[Vec<f64>]| -> Vec<Trajectory> {
        let start = |values: &Vec<f64>| -> Vec<f64> {
            values.iter().copied().chain(settled(quiet, values, &part, &weights)).collect()
        };
        let whole: Vec<Vec<f64>> = some.iter().map(start).collect();
        let out = quiet.rollout(&Thetas::from_lanes(&whole), recording, part.followed(), seed);
        tell(some.len());
        out
    };
    let own = followed(&[nominal.to_vec()]).into_iter().next().unwrap_or_default();
    let drawn: Vec<Trajectory> = lanes.par_chunks(LANES).flat_map_iter(followed).collect();
    let channel = |weight: &crate::sim2real::ChannelWeight| -> Option<Predicted> {
        let Measured { samples, unit, .. } = recording.channel(&weight.channel)?;
        let of = |trajectory: &Trajectory| {
            let simulated = trajectory.iter().find(|simulated| simulated.channel == weight.channel)?;
            Some(simulated.samples.clone())
        };
        let all: Vec<Vec<f64>> = drawn.iter().filter_map(of).collect();
        let count = all.len();
        let draws: Vec<Vec<f64>> = all.into_iter().filter(|draw| draw.iter().all(|v| v.is_finite())).collect();
        Some(Predicted {
            recording: recording.name.clone(),
            channel: weight.channel.clone(),
            unit: unit.clone(),
            time: recording.time.clone(),
            measured: samples.clone(),
            noise: weight.noise,
            nominal: of(&own)?,
            diverged: count - draws.len(),
            draws,
        })
    };
    weights.iter().filter_map(channel).collect()
}
