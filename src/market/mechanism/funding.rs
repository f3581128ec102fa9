//! Funding: what those who are long a perpetual future pay those who are short.

use crate::market::{ChargeKind, Execution, OrderLog, Report, Role};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Seed, Site, Thetas, Typical};

use super::Charging;

/// `fee += side * rate * value held` for each interval: what is long pays where the rate is positive, what is short receives.
///
/// Form `continuous`: `rate_per_8h` accrues with the time held, however often the account is told of it. Form `discrete`: `rate`
/// falls due as a whole at every multiple of `interval_hours` since midnight, UTC, that lies after the last charge and not after
/// this one: whoever is flat at that instant pays nothing. With eight hours these are 00:00, 08:00 and 16:00.
///
/// Source: the funding of perpetual futures, He, Manela, Ross & von Wachter, "Fundamentals of perpetual futures" (2022);
/// Ackerer, Hugonnier & Jermann, "Perpetual futures pricing" (2023).
#[derive(Debug, Clone, Copy)]
pub struct Funding;

const CONTINUOUS: usize = 0;
/// An hour [s].
const HOUR: f64 = 3_600.0;

impl Mechanism<Execution> for Funding {
    fn about(&self) -> About {
        About {
            name: "funding",
            site: Site::Observation,
            title: "funding",
            law: "fee = side * rate * value held, for each interval of 8 h, or at each multiple of an interval",
            source: "He, Manela, Ross & von Wachter (2022); Ackerer, Hugonnier & Jermann (2023)",
            remedy: "charge positions the funding of the venue",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let rate = |name| Parameter::new(name, "", 0.0).within(-0.1, 0.1).starting_at(&[1e-4, 1e-3]);
        let interval = Parameter::new("interval_hours", "h", 0.0).within(0.0, 24.0).starting_at(&[1.0, 8.0]).stepped();
        vec![
            Form { name: "continuous", parameters: vec![rate("rate_per_8h")] },
            Form { name: "discrete", parameters: vec![rate("rate"), interval] },
        ]
    }

    /// It needs positions that are held.
    fn applies(&self, _form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        log.has_a(Role::Holder)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        let intervals = (form != CONTINUOUS).then(|| thetas.row(1).iter().map(|hours| hours * HOUR).collect());
        Box::new(Transfer { rate: thetas.row(0).to_vec(), intervals })
    }
}

impl Charging for Funding {
    fn kind(&self) -> ChargeKind {
        ChargeKind::Funding
    }
}

#[derive(Clone)]
struct Transfer {
    rate: Vec<f64>,
    /// Time between two charges [s], where there is any.
    intervals: Option<Vec<f64>>,
}

impl Law<Execution> for Transfer {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.rate);
        if let Some(intervals) = &mut self.intervals {
            change.derived(intervals, |values| values[1] * HOUR);
        }
    }

    fn sense(&mut self, _time: f64, reports: &mut [Report]) {
        for (lane, (report, rate)) in reports.iter_mut().zip(&self.rate).enumerate() {
            if report.role != Role::Holder {
                continue;
            }
            let periods = match &self.intervals {
                None => report.held_for() / (8.0 * HOUR),
                Some(intervals) => due(report, intervals[lane]),
            };
            report.fee += report.side.sign() * rate * report.notional() * periods;
        }
    }
}

/// How many multiples of `interval` [s] since midnight, UTC, lie after the last charge and not after this one; none where there
/// is no interval.
fn due(report: &Report, interval: f64) -> f64 {
    const DAY: i64 = 86_400_000_000_000;
    let step = (interval * 1e9).round() as i64;
    if step <= 0 {
        return 0.0;
    }
    // Intervals that do not divide a day begin anew at midnight.
    let in_a_day = (DAY - 1) / step + 1;
    let count = |nanos: i64| nanos.div_euclid(DAY) * in_a_day + nanos.rem_euclid(DAY) / step;
    (count(report.until.0) - count(report.since.0)).max(0) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{InFlight, Side};
    use crate::sim2real::Timestamp;

    /// Funding of 2 units at 500 from `since` to `until` [h].
    fn charged(form: usize, theta: &[f64], side: Side, since: f64, until: f64) -> f64 {
        let at = |hours: f64| Timestamp(1_700_006_400 * Timestamp::NANOS).plus_seconds(hours * HOUR);
        let held = InFlight::market(side, 2.0, at(since), 500.0, 500.0).as_a(Role::Holder).arriving(at(until));
        let mut reports = [Report::of(&held, 500.0, 2.0)];
        Funding.law(form, &Thetas::single(theta), Seed(1)).sense(0.0, &mut reports);
        reports[0].fee
    }

    #[test]
    fn continuous_funding_does_not_depend_on_how_often_it_is_charged() {
        // A thousand at a basis point every 8 h: a tenth in 8 h.
        assert!((charged(0, &[1e-4], Side::Buy, 1.0, 9.0) - 0.1).abs() < 1e-12);
        assert!((charged(0, &[1e-4], Side::Sell, 1.0, 9.0) + 0.1).abs() < 1e-12);
        let parts: f64 = (0..16).map(|k| charged(0, &[1e-4], Side::Buy, f64::from(k), f64::from(k + 1))).sum();
        assert!((parts - 0.2).abs() < 1e-12);
    }

    #[test]
    fn discrete_funding_falls_due_at_its_instants_and_once() {
        // The clock of the test begins at midnight, UTC.
        let due = |since, until| charged(1, &[1e-4, 8.0], Side::Buy, since, until);
        for (since, until, periods) in
            [(0.0, 7.9, 0.0), (7.9, 8.0, 1.0), (8.0, 8.1, 0.0), (8.0, 16.0, 1.0), (1.0, 25.0, 3.0), (23.0, 24.0, 1.0)]
        {
            assert!((due(since, until) - 0.1 * periods).abs() < 1e-12, "{since} to {until} h: {}", due(since, until));
        }
        assert_eq!(charged(1, &[1e-4, 0.0], Side::Buy, 0.0, 24.0), 0.0);
        // Every 7 h: at 7, 14 and 21 h, and again at midnight.
        assert!((charged(1, &[1e-4, 7.0], Side::Sell, 1.0, 24.5) + 0.4).abs() < 1e-12);
    }
}
