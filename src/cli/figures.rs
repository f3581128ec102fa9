//! Comparisons as a report draws them.

use crate::report::{Abscissa, DiagnosisFigures, Trace};
use crate::sim2real::Clock;
use crate::sim2real::diagnose::{Comparison, Excitation, Profile};

/// The figures of a report: `comparisons` over time, errors over states, and the commands of the next experiment.
pub(super) fn figures(
    comparisons: Vec<Comparison>,
    profiles: Vec<Profile>,
    excitation: Option<Excitation>,
) -> DiagnosisFigures {
    DiagnosisFigures { traces: comparisons.into_iter().map(trace).collect(), profiles, excitation }
}

fn trace(comparison: Comparison) -> Trace {
    let abscissa = match comparison.clock {
        Clock::Sampled { .. } => Abscissa::Time,
        Clock::Event => Abscissa::Order,
    };
    Trace {
        recording: comparison.recording,
        held_out: comparison.held_out,
        channel: comparison.channel,
        unit: comparison.unit,
        abscissa,
        time: comparison.time,
        measured: comparison.measured,
        nominal: comparison.nominal,
        recalibrated: comparison.recalibrated,
        trued: comparison.trued,
    }
}
