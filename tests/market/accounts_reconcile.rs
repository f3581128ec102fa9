//! Runs with everything an account knows, on drawn markets: each currency adds up to the last unit.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::account_scene::{at, minute, with};
use crate::market_scene::{MINUTE, bars, venue};
use crate::ways_scene::same_every_way;
use proptest::prelude::{ProptestConfig, any, proptest};
use trueup::market::metric::RoundTrip;
use trueup::market::{
    Account, ActionKind, Backtest, Cash, CorporateAction, Fraction, Instrument, Multiplier, OrderKind, Orders, Price,
    Quantity, Rate, Reason, Record, Requirement, Role, Sender, Settings, Side, Strategy, Terms, View,
};
use trueup::sim2real::Timestamp;

/// Asks for whatever it draws.
#[derive(Clone)]
struct Drawn(u64);

impl Drawn {
    fn draw(&mut self, below: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % below
    }
}

impl Strategy for Drawn {
    fn name(&self) -> &str {
        "drawn"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let instrument = view.event().instrument;
        let side = if self.draw(2) == 0 { Side::Buy } else { Side::Sell };
        let size = Quantity::nearest(1.0 + self.draw(300) as f64).unwrap();
        match self.draw(5) {
            0 | 1 => _ = orders.market(instrument, side, size),
            2 => {
                let price = view.price(instrument).unwrap().to_f64() * (0.98 + 0.01 * self.draw(5) as f64);
                orders.limit(instrument, side, size, view.restable(instrument, side, price).unwrap());
            }
            3 => {
                let oldest = view.orders(instrument).first().map(|order| order.id);
                oldest.into_iter().for_each(|id| orders.cancel(id));
            }
            _ => {}
        }
    }
}

/// Three instruments of their own terms on walks of 60 bars, drawn from `seed`.
fn drawn_market(seed: u64) -> Backtest {
    market_of(seed, 60)
}

/// The same, of so many bars: prices stay within a third and three times of where they start.
fn market_of(seed: u64, count: i64) -> Backtest {
    let mut draws = Drawn(seed);
    let mut walk = |start: f64| {
        let mut price = start;
        let rows: Vec<(f64, f64)> = (0..count)
            .map(|_| {
                let open = price;
                price = (price * (0.97 + 0.001 * draws.draw(61) as f64)).clamp(start / 3.0, 3.0 * start);
                ((open * 100.0).round() / 100.0, (price * 100.0).round() / 100.0)
            })
            .collect();
        bars(&rows)
    };
    let histories = vec![walk(100.0), walk(40.0), walk(250.0)];
    let margin = |initial, maintenance| Requirement {
        initial: Fraction::percent(initial),
        maintenance: Fraction::percent(maintenance),
    };
    let terms = vec![
        Terms::default().with_regulation_t(),
        Terms { currency: 1, long: margin(20, 15), short: margin(30, 25), ..Terms::default() },
        Terms { currency: 2, multiplier: Multiplier::new(7).unwrap(), long: margin(10, 8), short: margin(10, 8) },
    ];
    let rates: Vec<_> =
        (0..count).map(|k| (Timestamp(k * MINUTE + 7), Price(1_000_000_000 + draws.draw(300_000_001) as i64))).collect();
    let mut actions: Vec<CorporateAction> = (0..9)
        .map(|k| {
            let (instrument, minutes) = (k % 3, 2 + draws.draw(57) as i64);
            let kind = match draws.draw(3) {
                0 => ActionKind::Split { new: 1 + draws.draw(4) as u32, old: 1 + draws.draw(4) as u32 },
                _ => ActionKind::Dividend {
                    per_unit: Price(1 + draws.draw(2_000_000_000) as i64),
                    withholding: Fraction::nearest(draws.draw(300_000_000) as f64 / 1e9).unwrap(),
                },
            };
            CorporateAction { at: minute(minutes), instrument, kind }
        })
        .collect();
    actions.sort_by_key(|action| action.at);
    let account = Account {
        currencies: ["USD", "EUR", "JPY"].map(str::to_owned).to_vec(),
        terms,
        rates: vec![Rate::Known([vec![(Timestamp(0), at(1.1))], rates].concat()), Rate::Constant(Price(6_789_123))],
        actions,
    };
    let parts = [
        ("half_spread", "bps", 3.0),
        ("commission", "bps", 0.7),
        ("borrow_fee", "held", 0.4),
        ("participation_cap", "", 0.2),
    ];
    let instruments: Vec<Instrument> = ["A", "B", "C"].map(crate::market_scene::instrument).to_vec();
    Backtest::new(instruments, histories, venue(&parts), with(account)).unwrap()
}

/// Cash of each currency by its fills, dividends and splits alone.
fn cash_by_hand(record: &Record) -> Vec<i128> {
    let ledger = &record.ledger;
    let mut all: Vec<i128> = ledger.balances().iter().map(|balance| balance.opening.0).collect();
    for fill in &record.blotter.fills {
        let terms = ledger.terms()[fill.instrument];
        let value = (fill.price * fill.quantity.signed(fill.side)).0 * i128::from(terms.multiplier.get());
        all[terms.currency] -= value + fill.fee.0;
    }
    for booked in &record.account.actions {
        all[ledger.terms()[booked.action.instrument].currency] += booked.received.0;
    }
    for (income, terms) in ledger.income().iter().zip(ledger.terms()) {
        all[terms.currency] -= income.charges.total().unwrap().0;
    }
    all
}

/// Each currency holds what fills, dividends, charges and splits leave of what it began with, and all of them together are the equity:
/// to the last unit.
fn adds_up(record: &Record) {
    let ledger = &record.ledger;
    let by_hand = cash_by_hand(record);
    let trips = RoundTrip::of(record).unwrap();
    let (mut exact, one) = (0_i128, 1_000_000_000_i128);
    for (k, balance) in ledger.balances().iter().enumerate() {
        assert_eq!(balance.cash.0, by_hand[k], "currency {k}");
        let mut worth = balance.opening.0;
        for (number, (position, income)) in ledger.positions().iter().zip(ledger.income()).enumerate() {
            if position.currency != k {
                continue;
            }
            let gain = position.realised.0 + position.value().0 - position.basis.0;
            let by_trips: i128 = trips.iter().filter(|trip| trip.instrument == number).map(|trip| trip.gross.0).sum();
            assert_eq!(gain, by_trips, "instrument {number}");
            worth += gain - position.fees.0 + income.dividends.0 - income.withheld.0 - income.charges.total().unwrap().0;
        }
        assert_eq!(balance.worth().unwrap().0, worth, "currency {k}");
        exact += worth * balance.rate.map_or(one, |rate| i128::from(rate.0));
    }
    assert_eq!(ledger.equity().unwrap().0, exact.div_euclid(one));
    assert_eq!(record.equity.last().unwrap().equity, ledger.equity().unwrap().to_f64());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// Nothing was created and nothing lost, in each currency, to the last unit.
    #[test]
    fn a_run_with_everything_reconciles_to_the_last_unit(seed in any::<u64>()) {
        let backtest = drawn_market(seed);
        let record = backtest.run(&mut Drawn(seed ^ 0x5bd1_e995)).unwrap();
        adds_up(&record);
        let again = drawn_market(seed).run(&mut Drawn(seed ^ 0x5bd1_e995)).unwrap();
        assert_eq!(record, again);
        same_every_way(&backtest, &record, &Drawn(seed ^ 0x5bd1_e995), 1 + seed as usize % 7);
        for order in &record.blotter.orders {
            assert!(order.filled <= order.quantity && (order.sender == Sender::Strategy || order.kind == OrderKind::Market));
        }
        assert!(record.blotter.fills.iter().all(|fill| fill.why.role != Role::Holder));
    }
}

/// The draws of the property do what it is about.
#[test]
fn the_drawn_markets_hold_every_kind_of_thing() {
    let (mut calls, mut splits, mut paid, mut margin) = (0, 0, 0, 0);
    for seed in 0..12 {
        let record = drawn_market(seed).run(&mut Drawn(seed ^ 0x5bd1_e995)).unwrap();
        calls += record.account.margin_calls.len();
        splits += record.blotter.orders.iter().filter(|order| order.reason == Some(Reason::Split)).count();
        paid += record.account.actions.iter().filter(|booked| booked.received != Cash::ZERO).count();
        margin += record.blotter.rejected.get(&Reason::Margin).copied().unwrap_or_default();
    }
    assert!(
        calls > 0 && splits > 0 && paid > 12 && margin > 0,
        "{calls} calls, {splits} ended, {paid} paid, {margin} refused"
    );
}

/// A million orders of one account, of which more than half fill: nothing drifts.
#[test]
fn a_million_orders_create_and_lose_nothing() {
    let backtest = market_of(11, 600_000);
    let settings = Settings { max_leverage: 1e6, ..backtest.settings().clone() };
    let rich = Settings { cash: Cash::nearest(1e10).unwrap(), ..settings };
    let (instruments, venue) = (backtest.instruments().to_vec(), backtest.venue().clone());
    let backtest = Backtest::new(instruments, backtest.histories().to_vec(), venue, rich).unwrap();
    let record = backtest.run(&mut Drawn(12)).unwrap();
    let (orders, fills) = (record.blotter.orders.len(), record.blotter.fills.len());
    println!("{orders} orders, {fills} fills, {:?}", record.blotter.rejected);
    assert!(orders > 1_000_000 && fills > 500_000, "{orders} orders, {fills} fills");
    adds_up(&record);
    let filled: i128 = record.blotter.fills.iter().map(|fill| i128::from(fill.quantity.0)).sum();
    assert_eq!(filled, record.blotter.orders.iter().map(|order| i128::from(order.filled.0)).sum::<i128>());
}
