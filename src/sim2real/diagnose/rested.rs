//! Whether recordings begin at rest, as they often do: what has to set in motion what rested explains them worse.

use super::hypothesis::Hypothesis;
use super::whiteness::ChannelMisfit;
use crate::sim2real::identify::State;

/// Twice the logarithm of by how much likelier what was fitted is where recordings begin at rest than where they begin anyhow: what
/// has to set in motion what rested to explain a recording explains it worse. 0 where it does not begin at rest.
///
/// A spike at rest beside a slab as wide as motion usually is (George & McCulloch, "Variable selection via Gibbs sampling", Journal of
/// the American Statistical Association 88 (1993)).
pub(super) fn rested<T>(hypothesis: &Hypothesis<T>) -> f64 {
    let State { initial, values, .. } = &hypothesis.fit.state;
    // What is left may be more than noise, and every so many rows of it tell one thing.
    let widening = |m: &ChannelMisfit| (m.sum_of_squares / m.count.max(1) as f64).max(1.0) * m.autocorrelation_time.max(1.0);
    let widened = hypothesis.misfits.iter().map(widening).fold(1.0, f64::max);
    let all = initial.iter().flatten().zip(values.iter().flatten()).zip(hypothesis.fit.initial_std.iter().flatten());
    all.filter_map(|((parameter, value), std)| {
        let (slab, known) = (parameter.rests_or?.powi(2), widened * std * std);
        let log_odds = ((known + slab) / known).ln() - value * value * slab / (known * (known + slab));
        Some(if log_odds.is_finite() { log_odds.max(0.0) } else { 0.0 })
    })
    .sum()
}

#[cfg(test)]
mod tests {
    use super::super::weigh::tests::leaving;
    use super::*;
    use crate::sim2real::Parameter;

    #[test]
    fn what_need_not_set_in_motion_what_rested_explains_better() {
        let begun = |velocity: f64, at_rest: bool| {
            let mut hypothesis = leaving(1.0, 6_000.0);
            let rate = Parameter::new("initial velocity", "rad/s", 0.0);
            let rate = if at_rest { rate.at_rest_or_about(1.0) } else { rate };
            let place = Parameter::new("initial position", "rad", 0.0);
            hypothesis.fit.state =
                State { initial: vec![vec![place, rate]], values: vec![vec![0.3, velocity]], misfit: 1.0 };
            hypothesis.fit.initial_std = vec![vec![0.01, 0.01]];
            rested(&hypothesis)
        };
        // Twice the logarithm of a hundred: as much narrower is what is left open than what might be.
        assert!((begun(0.0, true) - 2.0 * 100.0_f64.ln()).abs() < 0.01);
        assert!((begun(0.02, true) - begun(0.0, true) + 4.0).abs() < 0.01, "two standard deviations away");
        assert_eq!([begun(0.05, true), begun(-3.0, true), begun(0.0, false)], [0.0; 3]);
        // Where what is left is as large as nine times the noise and colours three rows of it, less is known.
        let mut rough = leaving(9.0, 2_000.0);
        let rate = Parameter::new("initial velocity", "rad/s", 0.0).at_rest_or_about(1.0);
        rough.fit.state = State { initial: vec![vec![rate]], values: vec![vec![0.0]], misfit: 3.0 };
        rough.fit.initial_std = vec![vec![0.01]];
        assert!((rested(&rough) - (1.0 + 1.0 / 27e-4_f64).ln()).abs() < 1e-9);
        // What the recording does not tell at all says nothing.
        rough.fit.initial_std = vec![vec![f64::INFINITY]];
        assert_eq!(rested(&rough), 0.0);
    }
}
