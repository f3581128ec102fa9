//! The matching engine under whatever is asked of it: orders of every kind, at random, on random bars, quotes, books and trades. Nothing is
//! filled where the data show no market, nothing is filled twice, and who came first is served first.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use crate::anything_scene::{fills_are_of_orders, queued, run, served_in_turn};
use crate::market_scene::{settings, sized_quotes, whole_bar};
use proptest::prelude::{Just, ProptestConfig, Strategy as Generated, any, prop_assert, prop_oneof, proptest};
use trueup::market::{DepthAction, DepthChange, Fill, History, Order, Price, Print, QueueModel, Quotes, Role, Side};
use trueup::sim2real::Timestamp;

/// Bars of a walk in cents, with wicks.
fn random_bars() -> impl Generated<Value = History> {
    proptest::collection::vec((-15..16_i64, 0..8_i64, 0..8_i64, -6..7_i64), 8..80).prop_map(|steps| {
        let mut last = 10_000_i64;
        let bar = |(k, (move_by, above, below, gap)): (usize, (i64, i64, i64, i64))| {
            let open = last + gap;
            let close = open + move_by;
            last = close;
            let cents = [open, open.max(close) + above, open.min(close) - below, close];
            whole_bar(k as i64, cents.map(|cents| cents as f64 / 100.0), 1_000.0)
        };
        History::new(steps.into_iter().enumerate().map(bar).collect(), Quotes::default()).unwrap()
    })
}

/// Quotes of a walk in cents, and trades at or beyond the touch.
fn random_quotes() -> impl Generated<Value = History> {
    proptest::collection::vec((1..50_i64, -3..4_i64, 1..4_i64, 1..200_u32, 1..200_u32, 0..6_u8, 1..150_u32), 8..120)
        .prop_map(|steps| {
            let (mut time, mut bid, mut rows, mut prints) = (0, 10_000_i64, Vec::new(), Vec::new());
            for (gap, step, spread, bid_size, ask_size, trade, size) in steps {
                time += gap;
                bid += step;
                let price = |cents: i64| cents as f64 / 100.0;
                let ask = bid + spread;
                rows.push((time, price(bid), f64::from(bid_size), price(ask), f64::from(ask_size)));
                let mut print = |cents, aggressor| {
                    prints.push(Print {
                        time: Timestamp(time),
                        price: price(cents),
                        size: f64::from(size),
                        aggressor: Some(aggressor),
                    });
                };
                match trade {
                    0 => print(bid, Side::Sell),
                    1 => print(ask, Side::Buy),
                    2 => print(bid - 2, Side::Sell),
                    3 => print(ask + 2, Side::Buy),
                    _ => {}
                }
            }
            sized_quotes(&rows).with_prints(prints).unwrap()
        })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn on_bars_nothing_is_filled_off_them_or_out_of_turn(history in random_bars(), draws in any::<u64>()) {
        let (record, alone) = run(&history, settings(), draws);
        fills_are_of_orders(&record)?;
        for fill in &record.blotter.fills {
            let (bar, order) = (history.bars()[fill.why.row], record.blotter.order(fill.order_id).unwrap());
            prop_assert!(bar.low <= fill.price && fill.price <= bar.high, "{fill:?} in {bar:?}");
            prop_assert!(bar.open_at <= fill.filled_at && fill.filled_at <= bar.known_at, "{fill:?} in {bar:?}");
            // What came within a bar has no part in it.
            prop_assert!(order.arrives_at <= bar.open_at, "{order:?} in {bar:?}");
        }
        served_in_turn(&record, &alone, |order, fill| order.arrives_at <= history.bars()[fill.why.row].open_at)?;
    }

    #[test]
    fn on_quotes_nothing_is_filled_off_them_or_out_of_turn(
        history in random_quotes(),
        draws in any::<u64>(),
        model in prop_oneof![Just(QueueModel::Trades), Just(QueueModel::Proportional), Just(QueueModel::Log)],
        order in prop_oneof![Just(0.0), 0.0..3e-7_f64],
    ) {
        let (record, alone) = run(&history, queued(model, order), draws);
        fills_are_of_orders(&record)?;
        for fill in &record.blotter.fills {
            let quote = history.quotes().all().get(fill.why.row).unwrap();
            let [bid, ask] = [quote.bid(), quote.ask()].map(|price| Price::nearest(price.unwrap()).unwrap());
            let traded = || history.prints().iter().filter(|print| print.time == fill.filled_at).map(|p| Price::nearest(p.price).unwrap());
            // A taker pays what is quoted; who rests is filled where the market came to his price or through it.
            let reached = match (fill.why.role, fill.side) {
                (Role::Taker, Side::Buy) => fill.price == ask,
                (Role::Taker, _) => fill.price == bid,
                (_, Side::Buy) => traded().chain([ask]).any(|price| price <= fill.price),
                (_, Side::Sell) => traded().chain([bid]).any(|price| price >= fill.price),
            };
            prop_assert!(reached, "{fill:?} at {} to {}", bid.to_f64(), ask.to_f64());
            let limit = record.blotter.order(fill.order_id).unwrap().kind.limit();
            let within = limit.is_none_or(|limit| fill.side.accepts(fill.price, limit) || !alone.contains(&fill.order_id));
            prop_assert!(within, "{fill:?}, {limit:?}");
        }
        served_in_turn(&record, &alone, |order, fill| order.arrives_at < fill.filled_at)?;
    }
}

/// A book of five levels a side whose best prices walk, and trades at or beyond the touch.
fn random_book() -> impl Generated<Value = History> {
    proptest::collection::vec((1..50_i64, -3..4_i64, 1..4_i64, 1..200_u32, 0..8_u8, 1..150_u32), 8..120).prop_map(|steps| {
        let (mut time, mut bid, mut changes, mut prints) = (0, 10_000_i64, Vec::new(), Vec::new());
        let mut shown: Vec<(Side, i64)> = Vec::new();
        let price = |cents: i64| Price(cents * 10_000_000);
        for (gap, step, spread, size, trade, traded) in steps {
            time += gap;
            bid += step;
            let ask = bid + spread;
            let now: Vec<(Side, i64)> = (0..5).flat_map(|k| [(Side::Buy, bid - k), (Side::Sell, ask + k)]).collect();
            let mut set = |side: Side, cents: i64, size: f64| {
                let time = Timestamp(time);
                changes.push(DepthChange {
                    time,
                    known_at: time,
                    side,
                    action: DepthAction::Set,
                    price: price(cents),
                    size,
                });
            };
            shown.iter().filter(|level| !now.contains(level)).for_each(|(side, cents)| set(*side, *cents, 0.0));
            now.iter()
                .enumerate()
                .for_each(|(k, (side, cents))| set(*side, *cents, f64::from(1 + (size + 37 * k as u32) % 200)));
            shown = now;
            let mut print = |cents: i64, aggressor| {
                let (time, price) = (Timestamp(time), cents as f64 / 100.0);
                prints.push(Print { time, price, size: f64::from(traded), aggressor: Some(aggressor) });
            };
            match trade {
                0 => print(bid, Side::Sell),
                1 => print(ask, Side::Buy),
                2 => print(bid - 2, Side::Sell),
                3 => print(ask + 2, Side::Buy),
                _ => {}
            }
        }
        History::default().with_depth(changes).unwrap().with_prints(prints).unwrap()
    })
}

/// Best bid and ask by all changes before `time`, or until it.
fn best(history: &History, time: Timestamp, until: bool) -> [Option<Price>; 2] {
    let mut levels = std::collections::BTreeMap::new();
    for change in history.depth().iter().filter(|change| change.time < time || until && change.time == time) {
        levels.insert((change.side == Side::Sell, change.price), change.size);
    }
    let there = |sell: bool| {
        levels.iter().filter(move |((side, _), size)| *side == sell && **size > 0.0).map(|((_, price), _)| *price)
    };
    [there(false).max(), there(true).min()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn in_a_book_nothing_is_filled_off_it_or_out_of_turn(
        history in random_book(),
        draws in any::<u64>(),
        model in prop_oneof![Just(QueueModel::Trades), Just(QueueModel::Proportional), Just(QueueModel::Log)],
        order in prop_oneof![Just(0.0), 0.0..3e-7_f64],
    ) {
        let (record, alone) = run(&history, queued(model, order), draws);
        fills_are_of_orders(&record)?;
        for fill in &record.blotter.fills {
            let time = fill.filled_at;
            let of = |side: usize| [best(&history, time, false)[side], best(&history, time, true)[side]].into_iter().flatten();
            let traded = || history.prints().iter().filter(|print| print.time == time).map(|p| Price::nearest(p.price).unwrap());
            let reached = match (fill.why.role, fill.side) {
                (Role::Taker, Side::Buy) => of(1).any(|price| price == fill.price),
                (Role::Taker, _) => of(0).any(|price| price == fill.price),
                (_, Side::Buy) => traded().chain(of(1)).any(|price| price <= fill.price),
                (_, Side::Sell) => traded().chain(of(0)).any(|price| price >= fill.price),
            };
            prop_assert!(reached, "{fill:?} in {:?}", [best(&history, time, false), best(&history, time, true)]);
        }
        served_in_turn(&record, &alone, |order, fill| order.arrives_at < fill.filled_at)?;
    }
}

/// What is drawn brings about what is compared: orders of every kind are filled, and many in turn.
#[test]
fn the_draws_bring_about_every_kind_of_fill() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let (mut words, mut makers, mut compared) = (std::collections::BTreeSet::new(), 0, 0);
    for draws in 0..300 {
        let history = if draws % 2 == 0 {
            random_bars().new_tree(&mut runner).unwrap().current()
        } else {
            random_quotes().new_tree(&mut runner).unwrap().current()
        };
        let (record, alone) = run(&history, settings(), draws);
        for fill in &record.blotter.fills {
            words.insert(record.blotter.order(fill.order_id).unwrap().kind.word());
            makers += usize::from(fill.why.role == Role::Maker);
        }
        let there = |order: &Order, fill: &Fill| match history.bars().get(fill.why.row) {
            Some(bar) => order.arrives_at <= bar.open_at,
            None => order.arrives_at < fill.filled_at,
        };
        compared += served_in_turn(&record, &alone, there).unwrap();
    }
    println!("{makers} fills of orders that rested, {compared} compared; {words:?}");
    assert!(makers > 1_000 && compared > 500, "{makers} fills, {compared} compared");
    for kind in ["market", "limit", "stop", "stop_limit", "trailing_stop", "limit_on_close"] {
        assert!(words.contains(kind), "{kind} of {words:?}");
    }
}
