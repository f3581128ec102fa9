//! What the broker and the exchange charge.

use crate::market::{Execution, OrderLog, Report, Role};
use crate::sim2real::{About, Form, LaneChange, Law, Mechanism, Parameter, Seed, Site, Thetas, Typical};

/// A commission on each order filled, in the form of the broker's schedule; negative for a rebate.
///
/// - `bps`: `fee += bps * 1e-4 * price * quantity * multiplier`;
/// - `per_share`: `fee += per_share * quantity`, which of a future is by contract;
/// - `minimum`: the same, and at least `minimum` an order;
/// - `capped`: the same, and at most `maximum_bps` of the notional, which goes before the minimum, as US brokers have it;
/// - `per_order`: `fee += per_order`, however much is filled;
/// - `tiered`: `maker_bps` of the notional for orders that rest, `taker_bps` for those that take.
///
/// What was not filled pays nothing, and a position that is held neither. A resting order that fills in parts is charged for each
/// of them as for an order.
///
/// Source: the ways in which brokers and exchanges state their schedules; as fixed and variable explicit costs in Kissell,
/// *The Science of Algorithmic Trading and Portfolio Management* (2014), chapter 3; makers and takers, Foucault, Kadan &
/// Kandel, "Liquidity cycles and make/take fees in electronic markets", Journal of Finance 68 (2013).
#[derive(Debug, Clone, Copy)]
pub struct Commission;

const BPS: usize = 0;
const PER_SHARE: usize = 1;
const MINIMUM: usize = 2;
const CAPPED: usize = 3;
const PER_ORDER: usize = 4;

impl Mechanism<Execution> for Commission {
    fn about(&self) -> About {
        About {
            name: "commission",
            site: Site::Observation,
            title: "a commission",
            law: "fee = bps * price * quantity / 1e4, per_share * quantity within minimum and maximum, or per_order",
            source: "Kissell, The Science of Algorithmic Trading and Portfolio Management (2014), chapter 3",
            remedy: "charge the commission of the broker's schedule",
            contains: &[],
        }
    }

    fn forms(&self, _typical: &Typical) -> Vec<Form> {
        let bps = |name, starts: &[f64]| Parameter::new(name, "bps", 0.0).within(-100.0, 1_000.0).starting_at(starts);
        let per_share = || Parameter::new("per_share", "currency/unit", 0.0).within(-1e3, 1e4).starting_at(&[0.001, 0.005]);
        let minimum = || Parameter::new("minimum", "currency", 0.0).within(0.0, 1e6).starting_at(&[0.35, 1.0]);
        let maximum =
            Parameter::new("maximum_bps", "bps", f64::INFINITY).within(0.0, f64::INFINITY).starting_at(&[100.0, 50.0]);
        let per_order = Parameter::new("per_order", "currency", 0.0).within(-1e6, 1e6).starting_at(&[1.0, 5.0]);
        vec![
            Form { name: "bps", parameters: vec![bps("bps", &[0.1, 1.0])] },
            Form { name: "per_share", parameters: vec![per_share()] },
            Form { name: "minimum", parameters: vec![per_share(), minimum()] },
            Form { name: "capped", parameters: vec![per_share(), minimum(), maximum] },
            Form { name: "per_order", parameters: vec![per_order] },
            Form { name: "tiered", parameters: vec![bps("maker_bps", &[-0.2, 0.2]), bps("taker_bps", &[0.3, 1.0])] },
        ]
    }

    /// Tiers are told apart by orders of both kinds.
    fn applies(&self, form: usize, _plant: &Execution, log: &OrderLog) -> bool {
        form <= PER_ORDER || log.has_a(Role::Maker) && log.has_a(Role::Taker)
    }

    fn law(&self, form: usize, thetas: &Thetas, _seed: Seed) -> Box<dyn Law<Execution>> {
        let lane = |lane: usize| Schedule::of(form, |k| thetas.row(k)[lane]);
        Box::new(Charge { form, schedules: (0..thetas.lanes()).map(lane).collect() })
    }
}

/// What one lane charges.
#[derive(Debug, Clone, Copy)]
struct Schedule {
    /// Of the notional [bps].
    maker_bps: f64,
    taker_bps: f64,
    /// [currency/unit]
    per_share: f64,
    /// Least that is charged for the shares of an order [currency].
    minimum: Option<f64>,
    /// Most that is charged for the shares of an order [bps of the notional].
    maximum_bps: f64,
    /// [currency]
    per_order: f64,
}

impl Schedule {
    const FREE: Self =
        Self { maker_bps: 0.0, taker_bps: 0.0, per_share: 0.0, minimum: None, maximum_bps: f64::INFINITY, per_order: 0.0 };

    /// That of form `form` where its parameters have these values.
    fn of(form: usize, value: impl Fn(usize) -> f64) -> Self {
        match form {
            BPS => Self { maker_bps: value(0), taker_bps: value(0), ..Self::FREE },
            PER_SHARE => Self { per_share: value(0), ..Self::FREE },
            MINIMUM => Self { per_share: value(0), minimum: Some(value(1)), ..Self::FREE },
            CAPPED => Self { per_share: value(0), minimum: Some(value(1)), maximum_bps: value(2), ..Self::FREE },
            PER_ORDER => Self { per_order: value(0), ..Self::FREE },
            _ => Self { maker_bps: value(0), taker_bps: value(1), ..Self::FREE },
        }
    }

    /// The fee of what `report` tells of [currency].
    fn fee(&self, report: &Report) -> f64 {
        let bps = if report.role == Role::Maker { self.maker_bps } else { self.taker_bps };
        let shares = self.per_share * report.quantity;
        let shares = self.minimum.map_or(shares, |minimum| shares.max(minimum));
        let most = 1e-4 * self.maximum_bps * report.notional();
        bps * report.quantity * report.multiplier * (1e-4 * report.price) + shares.min(most) + self.per_order
    }
}

#[derive(Clone)]
struct Charge {
    form: usize,
    schedules: Vec<Schedule>,
}

impl Law<Execution> for Charge {
    fn change(&mut self, change: &LaneChange<'_>) {
        let form = self.form;
        change.derived(&mut self.schedules, |values| Schedule::of(form, |k| values[k]));
    }

    fn sense(&mut self, _time: f64, reports: &mut [Report]) {
        for (report, schedule) in reports.iter_mut().zip(&self.schedules) {
            if report.trades() && report.quantity > 0.0 {
                report.fee += schedule.fee(report);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{InFlight, Side};
    use crate::sim2real::Timestamp;

    /// What form `form` charges for `quantity` at `price`.
    fn fee(form: usize, theta: &[f64], role: Role, quantity: f64, price: f64) -> f64 {
        let order = InFlight::market(Side::Sell, quantity, Timestamp(0), price, price).as_a(role);
        let mut reports = [Report::of(&order, price, quantity)];
        Commission.law(form, &Thetas::single(theta), Seed(1)).sense(0.0, &mut reports);
        reports[0].fee
    }

    fn close(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-12
    }

    #[test]
    fn shares_are_charged_within_the_minimum_and_the_maximum_of_an_order() {
        // The fixed schedule of a US broker: half a cent a share, at least 1.00, at most 1 % of the trade.
        let fixed = |quantity, price| fee(CAPPED, &[0.005, 1.0, 100.0], Role::Taker, quantity, price);
        assert!(close(fixed(1_000.0, 25.0), 5.0));
        assert!(close(fixed(100.0, 25.0), 1.0));
        assert!(close(fixed(1_000.0, 0.25), 2.5), "a cent in a quarter is more than half a cent a share");
        assert!(close(fixed(10.0, 0.2), 0.02), "the maximum goes before the minimum");
        assert!(close(fee(MINIMUM, &[0.005, 1.0], Role::Maker, 10.0, 0.2), 1.0));
        assert!(close(fee(PER_SHARE, &[-0.002], Role::Maker, 500.0, 20.0), -1.0));
    }

    #[test]
    fn orders_pay_flat_or_by_what_they_do() {
        assert!(close(fee(PER_ORDER, &[4.95], Role::Taker, 3.0, 10.0), 4.95));
        assert!(close(fee(BPS, &[0.5], Role::Maker, 100.0, 50.0), 0.25));
        let tiered = |role| fee(5, &[-0.2, 0.3], role, 100.0, 50.0);
        assert!(close(tiered(Role::Maker), -0.1) && close(tiered(Role::Taker), 0.15));
    }

    #[test]
    fn what_is_held_or_not_filled_pays_no_commission() {
        for (form, theta) in [(BPS, vec![1.0]), (PER_ORDER, vec![1.0]), (CAPPED, vec![0.005, 1.0, 100.0])] {
            assert_eq!(fee(form, &theta, Role::Holder, 100.0, 50.0), 0.0);
            assert_eq!(fee(form, &theta, Role::Taker, 0.0, 50.0), 0.0);
        }
    }
}
