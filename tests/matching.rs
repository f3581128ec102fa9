//! The matching engine under whatever is asked of it: orders of every kind, at random, on random bars, quotes, books and trades. Nothing is
//! filled where the data show no market, nothing is filled twice, and who came first is served first.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

mod market_scene;

use market_scene::{instrument, quantity, settings, sized_quotes, venue, whole_bar};
use proptest::prelude::{Just, ProptestConfig, Strategy as Generated, any, prop_assert, prop_oneof, proptest};
use proptest::test_runner::TestCaseError;
use trueup::market::{
    Backtest, Condition, DepthAction, DepthChange, Fill, History, Latencies, Latency, Matching, Order, OrderKind, Orders,
    Price, Print, Quantity, QueueModel, Quotes, Record, Role, Settings, Side, Status, Strategy, Ticket, TimeInForce, View,
};
use trueup::sim2real::Timestamp;

/// Asks for whatever it draws, and remembers which orders stand alone, unconditionally and as they were sent.
struct Anything {
    draws: u64,
    alone: Vec<u64>,
}

impl Anything {
    fn draw(&mut self, below: u64) -> u64 {
        self.draws = self.draws.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.draws >> 33) % below
    }

    /// A price within ten ticks of `of`.
    fn near(&mut self, of: Price) -> Price {
        let tick = 10_000_000;
        Price(((of.0 / tick + self.draw(21) as i64 - 10) * tick).max(tick))
    }

    fn ticket(&mut self, view: &View<'_>) -> Option<Ticket> {
        let (mark, side) = (view.price(0)?, if self.draw(2) == 0 { Side::Buy } else { Side::Sell });
        let (price, trigger) = (self.near(mark), self.near(mark));
        let kind = match self.draw(12) {
            0 => OrderKind::Market,
            1 => OrderKind::Stop { trigger },
            2 => OrderKind::StopLimit { trigger, price },
            3 => OrderKind::TrailingStop { distance: Price(10_000_000 * (1 + self.draw(9) as i64)) },
            4 => OrderKind::MarketOnOpen,
            5 => OrderKind::LimitOnClose { price },
            _ => OrderKind::Limit { price },
        };
        let mut ticket = Ticket::new(0, side, quantity(1.0 + self.draw(60) as f64), kind);
        ticket.time_in_force = match self.draw(10) {
            0 => TimeInForce::Day,
            1 => TimeInForce::GoodTillDate(view.now() + 1 + self.draw(200) as i64),
            2 => TimeInForce::ImmediateOrCancel,
            3 => TimeInForce::FillOrKill,
            _ => TimeInForce::GoodTillCancelled,
        };
        ticket.condition = match self.draw(10) {
            0 => Condition::PostOnly,
            1 => Condition::ReduceOnly,
            _ => Condition::None,
        };
        Some(ticket)
    }
}

impl Strategy for Anything {
    fn name(&self) -> &str {
        "anything"
    }
    fn lookback(&self) -> usize {
        1
    }
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        let known = view.orders(0).len() as u64;
        match self.draw(8) {
            0..4 => {
                let Some(ticket) = self.ticket(view) else { return };
                let id = orders.submit(ticket);
                if ticket.condition == Condition::None {
                    self.alone.push(id.0);
                }
            }
            4 => {
                let (Some(entry), Some(mark)) = (self.ticket(view), view.price(0)) else { return };
                let (profit, loss) = (self.near(mark), self.near(mark));
                orders.bracket(entry, profit, loss);
            }
            5 => {
                let both: Vec<Ticket> = (0..2).filter_map(|_| self.ticket(view)).collect();
                orders.one_cancels_other(&both);
            }
            6 if known > 0 => orders.cancel(view.orders(0)[self.draw(known) as usize].id),
            7 if known > 0 => {
                let (id, size) = (view.orders(0)[self.draw(known) as usize].id, 1.0 + self.draw(60) as f64);
                let price = view.price(0).map(|mark| self.near(mark));
                orders.replace(id, Some(quantity(size)), price);
                self.alone.retain(|alone| *alone != id.0);
            }
            _ => {}
        }
    }
}

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

fn run(history: &History, settings: Settings, draws: u64) -> (Record, Vec<u64>) {
    let settings = Settings { max_leverage: 1e3, ..settings };
    let backtest = Backtest::new(vec![instrument("A")], vec![history.clone()], venue(&[]), settings).unwrap();
    let mut strategy = Anything { draws, alone: Vec::new() };
    (backtest.run(&mut strategy).unwrap(), strategy.alone)
}

/// Queues by `model`, and messages that take `seconds` [s] each way.
fn queued(model: QueueModel, seconds: f64) -> Settings {
    let order = Latency::Constant { seconds };
    let latencies = Latencies { order: order.clone(), response: order, ..Latencies::default() };
    Settings { latencies, matching: Matching { queue: model, ..Matching::default() }, ..settings() }
}

/// Every fill is of an order that had arrived, within its limit; together they are what the order says was filled, and no more than
/// it asked for; nobody stands before the front of a queue.
fn fills_are_of_orders(record: &Record) -> Result<(), TestCaseError> {
    for fill in &record.blotter.fills {
        let order = record.blotter.order(fill.order_id).unwrap();
        prop_assert!(fill.quantity > Quantity::ZERO && fill.filled_at >= order.arrives_at, "{fill:?}");
        prop_assert!(fill.why.queued_behind >= 0.0, "{fill:?}");
    }
    for order in &record.blotter.orders {
        prop_assert!(
            filled_by(record, order, Timestamp::MAX) == order.filled && order.filled <= order.quantity,
            "{order:?}"
        );
    }
    Ok(())
}

fn filled_by(record: &Record, order: &Order, time: Timestamp) -> Quantity {
    let own = record.blotter.fills.iter().filter(|fill| fill.order_id == order.order_id && fill.filled_at <= time);
    own.fold(Quantity::ZERO, |sum, fill| sum + fill.quantity)
}

/// A limit order that nothing but the market can end.
fn plain(order: &Order, alone: &[u64]) -> Option<Price> {
    let OrderKind::Limit { price } = order.kind else { return None };
    let for_good = order.time_in_force == TimeInForce::GoodTillCancelled;
    let over = matches!(order.status, Status::Filled | Status::Unfilled);
    (for_good && over && alone.contains(&order.order_id)).then_some(price)
}

/// At each fill of an order that rested nobody with a better price was still waiting, nor anybody who came sooner with the same.
/// `there` says whether an order took part in what brought a fill.
fn served_in_turn(record: &Record, alone: &[u64], there: impl Fn(&Order, &Fill) -> bool) -> Result<usize, TestCaseError> {
    let mut compared = 0;
    for fill in record.blotter.fills.iter().filter(|fill| fill.why.role == Role::Maker) {
        let served = record.blotter.order(fill.order_id).unwrap();
        let Some(price) = plain(served, alone) else { continue };
        for other in record.blotter.orders.iter().filter(|o| o.side == served.side && o.order_id != served.order_id) {
            let Some(own) = plain(other, alone) else { continue };
            let ahead = match served.side {
                Side::Buy => own > price,
                Side::Sell => own < price,
            };
            if !(ahead || own == price && other.arrives_at < served.arrives_at) || !there(other, fill) {
                continue;
            }
            compared += 1;
            let served_too = filled_by(record, other, fill.filled_at) == other.quantity;
            prop_assert!(served_too, "{other:?} waits while {served:?} is served: {fill:?}");
        }
    }
    Ok(compared)
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
