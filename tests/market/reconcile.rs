//! Logs that part from a backtest in one known way each, made by a few lines of arithmetic and not by the venue: what parts
//! them is to be told, and the causes are to sum to the gap to the last unit.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use proptest::prelude::*;
use trueup::market::paper::{FindingKind, OrderWords, PaperFill, PaperFinding, PaperLog, PaperOrder, SourcePlace};
use trueup::market::reconcile::{
    Cause, Compared, Histories, Life, Lives, Reconciliation, Showing, Tolerance, assert_reconciles, clock_difference, lives,
    reconcile, replay,
};
use trueup::market::{
    Backtest, Cash, Execution, History, Instrument, Level, MECHANISMS, Multiplier, Orders, Price, Quantity, Quotes,
    Reference, Settings, Side, Strategy, View,
};
use trueup::sim2real::{Assembly, Seed, Timestamp};

const SECOND: i64 = Timestamp::NANOS;
/// Time between two quotes [ns].
const STEP: i64 = SECOND / 10;
const ORDERS: usize = 300;

struct Draws(u64);

impl Draws {
    fn below(&mut self, end: i64) -> i64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % end as u64) as i64
    }
}

/// Quotes whose mid wanders in cents and whose spread is two or four of them.
fn quotes(seed: u64) -> Quotes {
    let (mut draws, mut cents, mut quotes) = (Draws(seed), 10_000_i64, Quotes::with_depth(1));
    for k in 0..(ORDERS as i64 + 4) * 30 {
        cents += draws.below(3) - 1;
        let half = 1 + draws.below(2);
        let level = |cents: i64| Level { price: cents as f64 / 100.0, size: 1e6 };
        quotes.push(Timestamp(k * STEP), &[level(cents - half)], &[level(cents + half)]);
    }
    quotes
}

/// An order as it was decided.
#[derive(Clone, Copy)]
struct Decided {
    at: Timestamp,
    side: Side,
    units: i64,
}

/// An order about every three seconds, half a step after a quote.
fn decided(seed: u64) -> Vec<Decided> {
    let mut draws = Draws(seed ^ 0xabcd);
    let one = |k: usize| Decided {
        at: Timestamp((3 * k as i64 + 2) * SECOND + draws.below(9) * STEP + STEP / 2),
        side: if draws.below(2) == 0 { Side::Buy } else { Side::Sell },
        units: 1 + draws.below(9),
    };
    (0..ORDERS).map(one).collect()
}

/// In which ways reality is not what the backtest assumes.
#[derive(Clone, Copy, Debug)]
struct Reality {
    /// From decision to execution [ns].
    latency: i64,
    /// Half spreads that are paid.
    half_spreads: f64,
    /// What is paid beyond them.
    impact_bps: f64,
    fee_bps: f64,
    /// What is ordered, as a part of what was decided.
    sized: f64,
    /// What is filled of that.
    filled: f64,
    /// By how much later it is decided [ns].
    late: i64,
    /// Of so many orders one is missing.
    skips: Option<usize>,
}

/// As the backtest assumes it: at the mid, at once, for nothing.
const IDEAL: Reality =
    Reality { latency: 0, half_spreads: 0.0, impact_bps: 0.0, fee_bps: 0.0, sized: 1.0, filled: 1.0, late: 0, skips: None };

fn mid_and_half(quotes: &Quotes, at: Timestamp) -> (f64, f64) {
    let row = quotes.times().partition_point(|time| *time <= at) - 1;
    let quote = quotes.all().get(row).unwrap();
    let (bid, ask) = (quote.bid().unwrap(), quote.ask().unwrap());
    (0.5 * (bid + ask), 0.5 * (ask - bid))
}

/// The log that reality writes.
fn log(decided: &[Decided], quotes: &Quotes, reality: &Reality) -> PaperLog {
    let mut log = PaperLog { format: "test".into(), ..PaperLog::default() };
    for (k, order) in decided.iter().enumerate().filter(|(k, _)| reality.skips.is_none_or(|every| k % every != 1)) {
        let at = order.at + reality.late;
        let place = SourcePlace { table: "test".into(), row: Some(k + 1), column: None };
        let quantity = Quantity::nearest((order.units as f64 * reality.sized * 1e3).round() / 1e3).unwrap();
        let mut own = PaperOrder::new(&format!("x{k}"), "XYZ", order.side, place.clone());
        (own.quantity, own.kind, own.decided_at) = (Some(quantity), Some(OrderWords::Market), Some(at));
        log.orders.push(own);
        let filled_at = at + reality.latency;
        let (mid, half) = mid_and_half(quotes, filled_at);
        let sign = if order.side == Side::Buy { 1.0 } else { -1.0 };
        let price = mid + sign * (reality.half_spreads * half + 1e-4 * reality.impact_bps * mid);
        let price = Price::nearest(price).unwrap();
        let quantity = Quantity::nearest((quantity.to_f64() * reality.filled * 1e3).round() / 1e3).unwrap();
        let mut fill = PaperFill::new("XYZ", filled_at, quantity, price, place);
        fill.order_id = Some(format!("x{k}"));
        fill.fee = Some(Cash::nearest(1e-4 * reality.fee_bps * (price * quantity).to_f64()).unwrap());
        log.fills.push(fill);
    }
    log
}

/// Asks for what was decided.
#[derive(Clone)]
struct Scheduled(Vec<Decided>);

impl Strategy for Scheduled {
    fn name(&self) -> &str {
        "scheduled"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        while let Some(next) = self.0.first().copied() {
            if next.at > view.event().time {
                return orders.wake_at(next.at);
            }
            orders.market(0, next.side, Quantity(next.units * 1_000_000_000));
            self.0.remove(0);
        }
    }
}

/// A run on those quotes that fills at the mid.
fn run(quotes: &Quotes) -> Backtest {
    let instrument = Instrument {
        symbol: "XYZ".into(),
        tick_size: 1e-9,
        lot_size: 1e-3,
        average_daily_volume: None,
        daily_volatility: None,
    };
    let history = History::new(Vec::new(), quotes.clone()).unwrap();
    let settings = Settings { reference: Some(Reference::Mid), ..Settings::with_cash(Cash::nearest(1e9).unwrap()) };
    Backtest::new(vec![instrument], vec![history], Assembly::new(Execution, MECHANISMS), settings).unwrap()
}

/// What the backtest made of `decided`, as a log.
fn backtest_log(backtest: &Backtest, decided: &[Decided]) -> PaperLog {
    let record = backtest.run(&mut Scheduled(decided.to_vec())).unwrap();
    let mut log = PaperLog { format: "test".into(), ..PaperLog::default() };
    for order in &record.blotter.orders {
        let mut own = PaperOrder::new(&order.order_id.to_string(), "XYZ", order.side, SourcePlace::default());
        (own.quantity, own.kind, own.decided_at) = (Some(order.quantity), Some(OrderWords::Market), Some(order.decided_at));
        log.orders.push(own);
    }
    for fill in &record.blotter.fills {
        let mut own = PaperFill::new("XYZ", fill.filled_at, fill.quantity, fill.price, SourcePlace::default());
        (own.order_id, own.fee) = (Some(fill.order_id.to_string()), Some(fill.fee));
        log.fills.push(own);
    }
    log
}

fn compared(seed: u64, reality: &Reality) -> (Reconciliation, Lives) {
    let (quotes, decided) = (quotes(seed), decided(seed));
    let backtest = run(&quotes);
    let own = lives(&backtest_log(&backtest, &decided)).unwrap();
    assert_eq!(own.orders.len(), ORDERS, "{:?}", own.notes);
    let paper = lives(&log(&decided, &quotes, reality)).unwrap();
    let replayed = replay(backtest.start(), &["XYZ"], &paper.orders).unwrap();
    assert!(replayed.notes.is_empty(), "{:?}", replayed.notes);
    let histories = Histories::new(&["XYZ"], backtest.histories());
    let compared = Compared {
        backtest: &own,
        paper: &paper,
        replayed: Some(&replayed.orders),
        showing: Some(&histories),
        seed: Seed(1),
    };
    (reconcile(&compared).unwrap(), paper)
}

fn amount(found: &Reconciliation, cause: Cause) -> f64 {
    found.gaps[0].causes.iter().find(|own| own.cause == cause).map_or(0.0, |own| own.amount)
}

/// Exact amounts of 1e-18.
fn exact(text: &str) -> i128 {
    let (sign, text) = text.strip_prefix('-').map_or((1, text), |text| (-1, text));
    let (whole, part) = text.split_once('.').unwrap_or((text, ""));
    sign * format!("{whole}{part:0<18}").parse::<i128>().unwrap()
}

fn sums_exactly(found: &Reconciliation) {
    for gap in &found.gaps {
        let causes: i128 = gap.causes.iter().map(|cause| exact(&cause.amount_exact)).sum();
        assert_eq!(causes, exact(&gap.gap_exact), "{:?}", gap.causes);
        assert_eq!(exact(&gap.paper_exact) - exact(&gap.backtest_exact), causes);
    }
    let counts = &found.counts;
    assert_eq!(counts.pairs + counts.only_backtest, counts.backtest);
    assert_eq!(counts.pairs + counts.only_paper, counts.paper);
}

#[test]
fn what_is_the_same_is_found_to_be() {
    let (found, _) = compared(1, &IDEAL);
    assert_eq!((found.counts.pairs, found.counts.only_backtest, found.counts.only_paper), (ORDERS, 0, 0));
    assert_eq!(found.gaps[0].gap_exact, "0");
    assert!(found.gaps[0].causes.is_empty() && found.first_decision.is_none() && found.first_execution.is_none());
    let all = Tolerance::KEYS.iter().fold(Tolerance::default(), |mut tolerance, key| {
        assert!(tolerance.set(key, 0.0));
        tolerance
    });
    assert_reconciles(&found, &all);
}

/// Each effect alone is told by its name, with nearly nothing left for the others.
#[test]
fn each_cause_is_told_by_itself() {
    let realities = [
        (Reality { half_spreads: 1.0, ..IDEAL }, Cause::Spread),
        (Reality { half_spreads: 1.0, impact_bps: 3.0, ..IDEAL }, Cause::Impact),
        (Reality { fee_bps: 5.0, ..IDEAL }, Cause::Fees),
        (Reality { latency: 2 * SECOND, ..IDEAL }, Cause::Latency),
        (Reality { sized: 1.5, ..IDEAL }, Cause::Sizing),
        (Reality { filled: 0.5, ..IDEAL }, Cause::QueueFill),
        (Reality { skips: Some(5), ..IDEAL }, Cause::Signal),
    ];
    for (reality, cause) in realities {
        let (found, _) = compared(2, &reality);
        sums_exactly(&found);
        let own = amount(&found, cause);
        let others: f64 = Cause::ALL
            .into_iter()
            .filter(|other| *other != cause && !(cause == Cause::Impact && *other == Cause::Spread))
            .map(|other| amount(&found, other).abs())
            .sum();
        assert!(own.abs() > 1e-3 && others < 1e-6 * own.abs(), "{cause:?}: {own} beside {others}, {:?}", found.gaps);
    }
}

/// What spread, impact and fees came to is what the log was made with.
#[test]
fn amounts_are_those_the_log_was_made_with() {
    let reality = Reality { half_spreads: 1.0, impact_bps: 3.0, fee_bps: 2.0, ..IDEAL };
    let (found, paper) = compared(3, &reality);
    let quotes = quotes(3);
    let (mut spread, mut impact) = (0.0, 0.0);
    for life in &paper.orders {
        let (mid, half) = mid_and_half(&quotes, life.pieces[0].at);
        spread -= life.filled.to_f64() * half;
        impact -= life.filled.to_f64() * 3e-4 * mid;
    }
    let fees: f64 = -paper.orders.iter().map(|life: &Life| life.fees.to_f64()).sum::<f64>();
    for (cause, made) in [(Cause::Spread, spread), (Cause::Impact, impact), (Cause::Fees, fees)] {
        let told = amount(&found, cause);
        assert!((told - made).abs() < 1e-6 * made.abs(), "{cause:?}: {told}, made with {made}");
        let [low, high] = found.gaps[0].causes.iter().find(|own| own.cause == cause).unwrap().ci95.unwrap();
        assert!(low < told && told < high && high < 0.0, "{cause:?}: {low} to {high}");
    }
    let bands = found.bands.unwrap();
    assert_eq!((bands.executions, bands.better), (ORDERS, 0));
    assert!(bands.worse > ORDERS / 2, "{bands:?}");
    assert!(bands.pessimistic <= bands.optimistic);
}

/// A contract of fifty units makes fifty times of all that prices make, and once of what fees do.
#[test]
fn contracts_count_as_often_as_they_have_units() {
    let (quotes, decided) = (quotes(9), decided(9));
    let reality = Reality { half_spreads: 1.0, fee_bps: 2.0, ..IDEAL };
    let gaps = |units: i64| {
        let [own, other] = [IDEAL, reality].map(|reality| {
            let mut lives = lives(&log(&decided, &quotes, &reality)).unwrap();
            lives.orders.iter_mut().for_each(|life| life.multiplier = Multiplier::new(units).unwrap());
            lives
        });
        let compared = Compared { backtest: &own, paper: &other, replayed: None, showing: None, seed: Seed(1) };
        let found = reconcile(&compared).unwrap();
        sums_exactly(&found);
        (amount(&found, Cause::Price), amount(&found, Cause::Fees), found.orders[0].fee_bps.unwrap())
    };
    let (one, fifty) = (gaps(1), gaps(50));
    assert!((fifty.0 - 50.0 * one.0).abs() < 1e-9 * fifty.0.abs() && one.0 < 0.0, "{one:?} {fifty:?}");
    assert_eq!(fifty.1, one.1);
    assert!((fifty.2 * 50.0 - one.2).abs() < 1e-9, "{one:?} {fifty:?}");
}

/// Whoever compares a log is told what was odd about it, where that bears on the comparison.
#[test]
fn what_was_odd_about_a_log_is_told_beside() {
    let mut log = log(&decided(10), &quotes(10), &IDEAL);
    log.findings.add(PaperFinding::of_log(FindingKind::PolledTimes, "filled_at is when the bot asked"));
    log.findings.add(PaperFinding::of_log(FindingKind::RoundedNumber, "digits below 1e-9"));
    let notes = lives(&log).unwrap().notes;
    assert_eq!(notes, ["times are when a bot asked, not when it happened (1; the first: filled_at is when the bot asked)"]);
}

/// Paper that decides two seconds later decides on other prices.
#[test]
fn a_later_decision_is_one_of_data() {
    let (found, _) = compared(4, &Reality { late: 2 * SECOND + STEP / 4, ..IDEAL });
    sums_exactly(&found);
    assert!((found.clock.offset - 2.025).abs() < 1e-6, "{:?}", found.clock);
    let data = amount(&found, Cause::Data);
    assert!((data - found.gaps[0].gap).abs() < 1e-6 * data.abs(), "{:?}", found.gaps);
}

#[test]
fn orders_are_paired_whatever_the_clocks_and_whoever_is_missing() {
    for (offset, drift, zone) in [(0.0, 0.0, false), (7.3, 0.0, false), (-1.27, 3e-5, false), (5.0 * 3_600.0, 0.0, true)] {
        let decided = decided(5);
        let mut draws = Draws(99);
        let stamped =
            |at: Timestamp, jitter: i64| at.plus_seconds(offset + drift * at.seconds_since(decided[0].at)) + jitter;
        let (mut own, mut other) = (PaperLog::default(), PaperLog::default());
        let mut both = 0;
        for (k, order) in decided.iter().enumerate() {
            let (in_own, in_other) = (draws.below(6) > 0, draws.below(6) > 0);
            both += usize::from(in_own && in_other);
            let mut one = PaperOrder::new(&k.to_string(), "XYZ", order.side, SourcePlace::default());
            (one.quantity, one.decided_at) = (Some(Quantity(order.units * 1_000_000_000)), Some(order.at));
            if in_own {
                own.orders.push(one.clone());
            }
            one.decided_at = Some(stamped(order.at, draws.below(20) * 1_000_000));
            if in_other {
                other.orders.push(one);
            }
        }
        let (own, other) = (lives(&own).unwrap(), lives(&other).unwrap());
        let clock = clock_difference(&own.orders, &other.orders);
        assert!((clock.offset - 0.01 - offset).abs() < 0.02, "{offset}: {clock:?}");
        assert!((clock.drift - drift).abs() < 5e-6, "{drift}: {clock:?}");
        assert_eq!(clock.is_a_zone, zone, "{clock:?}");
        let compared = Compared { backtest: &own, paper: &other, replayed: None, showing: None, seed: Seed(1) };
        let found = reconcile(&compared).unwrap();
        let right = found.orders.iter().filter(|order| order.backtest.is_some() && order.backtest == order.paper).count();
        let wrong = found.counts.pairs - right;
        let side = |id: &Option<String>| id.as_ref().map(|id| decided[id.parse::<usize>().unwrap()].side);
        assert!(found.orders.iter().all(|order| {
            let sides = [side(&order.backtest), side(&order.paper)];
            sides.iter().flatten().all(|side| *side == order.side)
        }));
        assert!(right * 100 >= both * 99 && wrong * 50 <= both, "{right} of {both} right, {wrong} wrong");
    }
}

/// A log that sells what the backtest buys has none of its orders.
#[test]
fn an_order_of_the_other_side_is_another_order() {
    let (quotes, mut decided) = (quotes(8), decided(8));
    let own = lives(&log(&decided, &quotes, &IDEAL)).unwrap();
    decided.iter_mut().for_each(|order| order.side = order.side.opposite());
    let other = lives(&log(&decided, &quotes, &IDEAL)).unwrap();
    let compared = Compared { backtest: &own, paper: &other, replayed: None, showing: None, seed: Seed(1) };
    let found = reconcile(&compared).unwrap();
    sums_exactly(&found);
    let near = found.orders.iter().filter(|order| order.backtest == order.paper).count();
    assert_eq!((near, amount(&found, Cause::Signal) != 0.0), (0, true), "{:?}", found.counts);
}

#[test]
#[should_panic(expected = "price_bps")]
fn a_test_fails_where_they_part() {
    let (found, _) = compared(6, &Reality { half_spreads: 1.0, ..IDEAL });
    let mut tolerance = Tolerance::default();
    assert!(tolerance.set("price_bps", 0.5) && tolerance.set("unmatched", 0.0));
    assert_reconciles(&found, &tolerance);
}

/// From the order that is missing on, positions differ, until they are the same again.
#[test]
fn the_first_divergence_is_dated_and_what_followed_is_told() {
    let quotes = quotes(7);
    let decided = decided(7);
    let backtest = run(&quotes);
    let own = lives(&backtest_log(&backtest, &decided)).unwrap();
    let mut log = log(&decided, &quotes, &IDEAL);
    // One is missing; the first from the 50th on that is large enough makes up for it.
    let missing = (log.orders.remove(40), log.fills.remove(40));
    let made_up = |order: &PaperOrder| {
        let back = if missing.0.side == order.side { missing.1.quantity } else { -missing.1.quantity };
        order.quantity.unwrap() + back
    };
    let again = (49..).find(|k| made_up(&log.orders[*k]) > Quantity::ZERO).unwrap();
    let later = made_up(&log.orders[again]);
    (log.orders[again].quantity, log.fills[again].quantity) = (Some(later), later);
    let paper = lives(&log).unwrap();
    let compared = Compared { backtest: &own, paper: &paper, replayed: None, showing: None, seed: Seed(1) };
    let found = reconcile(&compared).unwrap();
    sums_exactly(&found);
    let first = found.first_decision.unwrap();
    assert_eq!((first.at, first.orders_from_there, first.of_these_differ), (decided[40].at, ORDERS - 40, 2), "{first:?}");
    assert_eq!(first.same_positions_again, Some(decided[again + 1].at));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 5, failure_persistence: None, ..ProptestConfig::default() })]
    /// Whatever goes together: causes sum to the gap, and the gap is one worth less the other.
    #[test]
    fn causes_sum_to_the_gap(
        seed in 0..1_000_u64, latency in 0..5_i64, half_spreads in -0.5..2.0_f64, impact_bps in 0.0..9.0_f64,
        fee_bps in -1.0..9.0_f64, sized in 0.2..3.0_f64, filled in 0.0..1.0_f64, late in 0..3_i64, skips in 3..12_usize,
    ) {
        let latency = latency * SECOND / 3;
        let reality = Reality { latency, half_spreads, impact_bps, fee_bps, sized, filled, late: late * SECOND / 2, skips: Some(skips) };
        let (found, paper) = compared(seed, &reality);
        sums_exactly(&found);
        let (quotes, decided) = (quotes(seed), decided(seed));
        let backtest = run(&quotes);
        let own = lives(&backtest_log(&backtest, &decided)).unwrap();
        let histories = Histories::new(&["XYZ"], backtest.histories());
        for showing in [None, Some(&histories as &dyn Showing)] {
            let compared = Compared { backtest: &own, paper: &paper, replayed: None, showing, seed: Seed(1) };
            sums_exactly(&reconcile(&compared).unwrap());
        }
    }
}
