//! How many messages would tell apart what these cannot: orders are no commands that one designs, but one can send more of them.
//!
//! Evidence for one law beside another grows with the number of messages like these, so what these say of two tells how many say enough.

use super::NextExperiment;
use super::hypothesis::Inquiry;
use super::rivals::{Place, WITHIN};
use super::selection::Selection;
use crate::sim2real::Twin;

/// Evidence that is less than this is chance: nobody knows of how many messages it would be more.
const CHANCE: f64 = 0.5;
/// More messages than this many times those at hand are as good as never.
const NEVER: f64 = 200.0;

/// What to send, where rivals are left of what was found: how many messages like these, or others, where their number alone does not
/// help.
pub(super) fn settled_by<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    places: &[Place],
) -> Option<NextExperiment> {
    let name = |number: usize| inquiry.candidates[number].about.name;
    let sent: f64 = inquiry
        .evidence
        .compared
        .iter()
        .map(|part| {
            let share = part.rows.len() as f64 / part.recording.time.len().max(1) as f64;
            share * inquiry.twin.sent(part.recording) as f64
        })
        .sum();
    let mut rivals: Vec<String> = Vec::new();
    let mut told: Vec<String> = Vec::new();
    for (own, place) in selection.selected.added.iter().zip(places) {
        let own = name(*own);
        for (other, loss) in place.others.iter().filter(|(other, loss)| *loss < WITHIN && name(*other) != own) {
            let other = name(*other);
            told.push(told_of(own, other, sent, *loss));
            for id in [own, other] {
                if !rivals.iter().any(|known| known == id) {
                    rivals.push(id.to_owned());
                }
            }
        }
    }
    let what = told.join("; ");
    (!rivals.is_empty()).then_some(NextExperiment {
        what,
        file: None,
        rivals,
        separation: None,
        gain: None,
        gain_so_far: None,
    })
}

/// How many messages tell one law from another that loses by `loss`, a gain in twice the log-likelihood, after so many were `sent`.
fn told_of(own: &str, other: &str, sent: f64, loss: f64) -> String {
    let times = WITHIN / loss.max(1e-12);
    if loss < CHANCE || times > NEVER {
        return format!(
            "orders like these do not tell {own} from {other}, however many: send some of other sizes and at other intervals, in a market \
             that moves more and less"
        );
    }
    format!(
        "{} orders like these would tell {own} from {other}, where {} say {loss:.1} of the {WITHIN:.0} it takes",
        rounded_up(times * sent),
        sent.round()
    )
}

/// A number to two digits, no less than it is.
fn rounded_up(value: f64) -> f64 {
    let step = 10.0_f64.powf(value.max(1.0).log10().floor() - 1.0).max(1.0);
    (value / step).ceil() * step
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_orders_would_settle_it() {
        let told = told_of("permanent_impact", "transient_impact", 612.0, 3.2);
        let expected =
            "2000 orders like these would tell permanent_impact from transient_impact, where 612 say 3.2 of the 10 it takes";
        assert_eq!(told, expected);
        let never = told_of("permanent_impact", "transient_impact", 612.0, 0.1);
        assert!(
            never.starts_with("orders like these do not tell permanent_impact from transient_impact, however many"),
            "{never}"
        );
    }

    #[test]
    fn numbers_are_rounded_up_to_two_digits() {
        assert_eq!([1_912.5, 1_900.0, 87.2, 3.0].map(rounded_up), [2_000.0, 1_900.0, 88.0, 3.0]);
    }
}
