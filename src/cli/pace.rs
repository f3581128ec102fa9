//! How often the controller of a twin acts, where the twin does not say it: at every step, or once a row.

use crate::io::{ControllerEntry, TwinFile};
use crate::report::quantity::number;
use crate::sim2real::diagnose::Comparison;

use super::diagnosed::Diagnosed;

/// `twin` with a controller that acts once in `spacing` [s], where it has one and does not say how often it acts.
pub(super) fn once_a_row(twin: &TwinFile, spacing: f64) -> Option<TwinFile> {
    let controller = twin.controller.as_ref().filter(|controller| controller.period.is_none())?;
    let mut paced = twin.clone();
    paced.controller = Some(ControllerEntry { period: Some(spacing), ..controller.clone() });
    Some(paced)
}

/// Evidence above this [twice a log-likelihood] decides.
const DECISIVE: f64 = 10.0;

/// The one of two diagnoses of the same recordings that explains them better.
pub(super) fn better(at_every_step: Diagnosed, once_a_row: Diagnosed) -> Diagnosed {
    let names = |diagnosed: &Diagnosed| diagnosed.diagnosis.effects.len();
    match reason(favoured(&once_a_row, &at_every_step), names(&once_a_row), names(&at_every_step)) {
        Some(why) => told(once_a_row, why),
        None => at_every_step,
    }
}

/// Why a controller that acts once a row is taken rather than one that acts at every step, if it is: it is `favoured` by so much
/// evidence; or it does as well with fewer `names`, where the other needs a saturation or a delay to stand for moments at which
/// the controller did not act.
fn reason(favoured: f64, names: usize, names_at_every_step: usize) -> Option<&'static str> {
    match favoured {
        f if f > DECISIVE => Some("explains these recordings better than at every step"),
        f if f > -DECISIVE && names < names_at_every_step => {
            Some("explains these recordings as well as at every step, with fewer names")
        }
        _ => None,
    }
}

/// By how much the fitted rows favour `a` over `b`, as mechanisms are weighed: residuals by as many of them as are independent, less
/// what each constant of what was named costs.
fn favoured(a: &Diagnosed, b: &Diagnosed) -> f64 {
    let left = |comparison: &Comparison| -> (f64, f64) {
        let rows = comparison.measured.iter().zip(&comparison.trued);
        let errors = rows.filter_map(|(measured, trued)| measured.map(|measured| measured - trued));
        errors.fold((0.0, 0.0), |(squares, rows), error| (squares + error * error, rows + 1.0))
    };
    let adequacy = |d: &Diagnosed| d.diagnosis.checks.adequacy.max(1.0);
    let correlated = adequacy(a).max(adequacy(b));
    let constants = |d: &Diagnosed| -> f64 { d.diagnosis.effects.iter().map(|e| e.parameters.len() as f64).sum() };
    let fitted = a.comparisons.iter().zip(&b.comparisons).filter(|(a, _)| !a.held_out);
    let (gain, rows) = fitted.fold((0.0, 1.0), |(gain, all), (a, b)| {
        let ((a, rows), (b, _)) = (left(a), left(b));
        let independent = rows / correlated;
        (gain + independent * (b / a.max(f64::MIN_POSITIVE)).max(f64::MIN_POSITIVE).ln(), all + independent)
    });
    gain - (constants(a) - constants(b)) * f64::ln(rows)
}

/// `diagnosed`, which says that it was taken for granted how often the controller acts, and what for.
fn told(mut diagnosed: Diagnosed, why: &str) -> Diagnosed {
    let period = diagnosed.file.controller.as_ref().and_then(|controller| controller.period);
    diagnosed.diagnosis.checks.notes.push(format!(
        "the twin does not say how often its controller acts: once a row, every {} s, {why}",
        number(period.unwrap_or_default())
    ));
    diagnosed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evidence_decides_and_where_it_does_not_fewer_names() {
        let reason = |favoured, names, others| reason(favoured, names, others).unwrap_or("");
        assert!(reason(11.0, 2, 1).contains("better"));
        assert!(reason(9.0, 1, 2).contains("fewer names") && reason(-9.0, 1, 2).contains("fewer names"));
        assert_eq!((reason(9.0, 1, 1), reason(9.0, 2, 1), reason(-11.0, 1, 2)), ("", "", ""));
    }
}
