//! What it costs to be short: the fee of whoever lends the shares.

use crate::market::{ChargeKind, Execution, OrderLog, Report, Role, Side};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Seed, Site, Thetas, Timestamp, Typical};

use super::Charging;

/// `fee += annual_rate * value of what is short * time held / 360 days`, charged on a position whenever the account is told of it.
///
/// Form `held`: `annual_rate` accrues with the time held, be the market open or closed. Form `overnight`: `overnight_rate` falls due
/// for each midnight, UTC, at which the position is held, as for shares that are delivered: whoever is flat by then pays nothing,
/// and three nights are charged over a weekend. Midnight of UTC lies between the sessions of Europe and America.
///
/// The rate is a fraction a year: 0.003 for shares that are easily had, 0.05 and more for those that are not. The year is that
/// of money markets (actual/360), in which brokers state it. What is long pays nothing.
///
/// Source: D'Avolio, "The market for borrowing stock", Journal of Financial Economics 66 (2002), who finds a value-weighted
/// mean of 0.0025 a year, and 0.043 for the tenth that is special.
#[derive(Debug, Clone, Copy)]
pub struct BorrowFee;

const HELD: usize = 0;
/// A day [s].
const DAY: f64 = 86_400.0;
/// A year of money markets [s].
const YEAR: f64 = 360.0 * DAY;

impl Mechanism<Execution> for BorrowFee {
    fn about(&self) -> About {
        About {
            name: "borrow_fee",
            site: Site::Observation,
            title: "a fee for borrowing what is sold short",
            law: "fee = annual_rate * short value * time held / 360 days, or of nights held",
            source: "D'Avolio, JFE 66 (2002)",
            remedy: "charge short positions the rate of whoever lends",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let one = |name, parameter| Form {
            name,
            parameters: vec![Parameter::new(parameter, "1/year", 0.0).within(0.0, 10.0).starting_at(&[0.003, 0.05])],
        };
        vec![one("held", "annual_rate"), one("overnight", "overnight_rate")]
    }

    /// It needs positions that are held.
    fn applies(&self, _form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        log.has_a(Role::Holder)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        let seconds = if form == HELD { Report::held_for } else { nights };
        Box::new(Loan { annual_rate: thetas.row(0).to_vec(), seconds })
    }
}

impl Charging for BorrowFee {
    fn kind(&self) -> ChargeKind {
        ChargeKind::Borrow
    }
}

#[derive(Clone)]
struct Loan {
    annual_rate: Vec<f64>,
    /// The time that is charged for [s].
    seconds: fn(&Report) -> f64,
}

impl Law<Execution> for Loan {
    fn change(&mut self, change: &LaneChange<'_>) {
        change.parameter(0, &mut self.annual_rate);
    }

    fn sense(&mut self, _time: f64, reports: &mut [Report]) {
        for (report, rate) in reports.iter_mut().zip(&self.annual_rate) {
            if report.role == Role::Holder && report.side == Side::Sell {
                report.fee += rate * report.notional() * (self.seconds)(report) / YEAR;
            }
        }
    }
}

/// A day for each midnight, UTC, after the last charge and not after this one [s].
fn nights(report: &Report) -> f64 {
    let day = |time: Timestamp| time.0.div_euclid(DAY as i64 * Timestamp::NANOS);
    (day(report.until) - day(report.since)).max(0) as f64 * DAY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::InFlight;

    fn charged(side: Side, role: Role, days: f64) -> f64 {
        charged_by(HELD, side, role, [0.0, days])
    }

    /// What form `form` charges from one time to another [days].
    fn charged_by(form: usize, side: Side, role: Role, [since, until]: [f64; 2]) -> f64 {
        let at = |days: f64| Timestamp(0).plus_seconds(days * DAY);
        let order = InFlight::market(side, 100.0, at(since), 50.0, 50.0).as_a(role);
        let mut reports = [Report::of(&order.arriving(at(until)), 50.0, 100.0)];
        BorrowFee.law(form, &Thetas::single(&[0.036]), Seed(1)).sense(0.0, &mut reports);
        reports[0].fee
    }

    #[test]
    fn over_night_whoever_is_flat_by_midnight_pays_nothing() {
        let short = |span| charged_by(1, Side::Sell, Role::Holder, span);
        assert_eq!([[0.1, 0.9], [0.0, 0.9], [1.0, 1.5]].map(short), [0.0; 3]);
        for (span, nights) in [([0.1, 1.0], 1.0), ([0.9, 1.1], 1.0), ([0.9, 3.95], 3.0)] {
            assert!((short(span) - 0.5 * nights).abs() < 1e-12, "{span:?}: {}", short(span));
        }
        assert_eq!(charged_by(1, Side::Buy, Role::Holder, [0.1, 9.0]), 0.0);
    }

    #[test]
    fn five_thousand_short_for_ten_days_at_three_point_six_percent_cost_five() {
        assert!((charged(Side::Sell, Role::Holder, 10.0) - 5.0).abs() < 1e-12);
        assert_eq!(charged(Side::Buy, Role::Holder, 10.0), 0.0);
        assert_eq!(charged(Side::Sell, Role::Taker, 10.0), 0.0);
        assert_eq!(charged(Side::Sell, Role::Holder, 0.0), 0.0);
    }
}
