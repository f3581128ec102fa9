//! What it costs to be short: the fee of whoever lends the shares.

use crate::market::{ChargeKind, Execution, OrderLog, Report, Role, Side};
use crate::sim2real::{About, Form, Law, Mechanism, Parameter, Seed, Site, Thetas, Typical};

use super::Charging;

/// `fee += annual_rate * value of what is short * time held / 360 days`, charged on a position whenever the account is told of it.
///
/// The rate is a fraction a year: 0.003 for shares that are easily had, 0.05 and more for those that are not. The year is that
/// of money markets (actual/360), in which brokers state it. What is long pays nothing.
///
/// Source: D'Avolio, "The market for borrowing stock", Journal of Financial Economics 66 (2002), who finds a value-weighted
/// mean of 0.0025 a year, and 0.043 for the tenth that is special.
#[derive(Debug, Clone, Copy)]
pub struct BorrowFee;

/// A year of money markets [s].
const YEAR: f64 = 360.0 * 86_400.0;

impl Mechanism<Execution> for BorrowFee {
    fn about(&self) -> About {
        About {
            name: "borrow_fee",
            site: Site::Observation,
            title: "a fee for borrowing what is sold short",
            law: "fee = annual_rate * short value * time held / 360 days",
            source: "D'Avolio, JFE 66 (2002)",
            remedy: "charge short positions the rate of whoever lends",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        Form::only(vec![Parameter::new("annual_rate", "1/year", 0.0).within(0.0, 10.0).starting_at(&[0.003, 0.05])])
    }

    /// It needs positions that are held.
    fn applies(&self, _form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        log.has_a(Role::Holder)
    }

    fn law(&self, _form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        Box::new(Loan { annual_rate: thetas.row(0).to_vec() })
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
}

impl Law<Execution> for Loan {
    fn sense(&mut self, _time: f64, reports: &mut [Report]) {
        for (report, rate) in reports.iter_mut().zip(&self.annual_rate) {
            if report.role == Role::Holder && report.side == Side::Sell {
                report.fee += rate * report.notional() * report.held_for() / YEAR;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::InFlight;
    use crate::sim2real::Timestamp;

    fn charged(side: Side, role: Role, days: f64) -> f64 {
        let order = InFlight::market(side, 100.0, Timestamp(0), 50.0, 50.0).as_a(role);
        let mut reports = [Report::of(&order.arriving(Timestamp(0).plus_seconds(days * 86_400.0)), 50.0, 100.0)];
        BorrowFee.law(0, &Thetas::single(&[0.036]), Seed(1)).sense(0.0, &mut reports);
        reports[0].fee
    }

    #[test]
    fn five_thousand_short_for_ten_days_at_three_point_six_percent_cost_five() {
        assert!((charged(Side::Sell, Role::Holder, 10.0) - 5.0).abs() < 1e-12);
        assert_eq!(charged(Side::Buy, Role::Holder, 10.0), 0.0);
        assert_eq!(charged(Side::Sell, Role::Taker, 10.0), 0.0);
        assert_eq!(charged(Side::Sell, Role::Holder, 0.0), 0.0);
    }
}
