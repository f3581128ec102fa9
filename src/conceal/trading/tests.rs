use std::collections::BTreeSet;

use super::draw::Set;
use super::effect::Effect;
use super::plan::Plan;
use super::recipe::{KNOWN, RESTING};
use super::size::Channel;
use super::*;
use crate::conceal::kind::planned;
use crate::conceal::{Column, Kind, Null, Table};
use crate::sim2real::Seed;

/// Case numbers of the first cases of a hundred that conceal `id` alone.
fn single(seed: Seed, id: &str) -> usize {
    (0..400).find(|index| planned(*index).0 == 0 && Plan::of(seed, *index).has(id)).unwrap()
}

fn times(table: &Table, name: &str) -> Vec<i64> {
    match table.column(name) {
        Some(Column::Time(values)) => values.clone(),
        _ => panic!("no times {name}"),
    }
}

fn whole(table: &Table, name: &str) -> Vec<i64> {
    match table.column(name) {
        Some(Column::Whole(values)) => values.clone(),
        _ => panic!("no whole numbers {name}"),
    }
}

/// A case is drawn from its seed and number alone: not from the thread it is drawn on, nor from what was drawn before it.
#[test]
fn a_case_is_the_same_wherever_and_whenever_it_is_drawn() {
    use rayon::prelude::*;
    let alone = draw(Seed(5), 3);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    let all: Vec<TradingCase> = pool.install(|| (2..4).into_par_iter().map(|index| draw(Seed(5), index)).collect());
    assert_eq!(all[1], alone);
    assert_ne!(all[0].train, alone.train);
    assert_ne!(draw(Seed(6), 3).train, alone.train);
}

/// Every name that can be concealed comes up, and each null.
#[test]
fn no_name_is_left_out() {
    let plans: Vec<Plan> = (0..100).map(|index| Plan::of(Seed(9), index)).collect();
    let of = |kind: Kind| plans.iter().filter(move |plan| plan.kind == kind).flat_map(|plan| plan.ids.clone());
    assert_eq!(of(Kind::Single).collect::<BTreeSet<_>>(), KNOWN.into_iter().chain(RESTING).collect());
    assert_eq!(of(Kind::Outside).collect::<BTreeSet<_>>().len(), 8);
    assert_eq!(of(Kind::NotExcited).collect::<BTreeSet<_>>().len(), 8);
    let nulls: BTreeSet<Kind> = plans.iter().map(|plan| plan.kind).filter(|kind| matches!(kind, Kind::Null(_))).collect();
    let every = [Null::White, Null::HeavyTailed, Null::Coloured, Null::Alpha, Null::Rounded, Null::MisSet];
    assert_eq!(nulls, every.into_iter().map(Kind::Null).collect());
}

/// Log and tape are such as a recorder could have written: in order, whole, nothing filled before it was decided.
#[test]
fn days_are_what_a_recorder_could_have_written() {
    for index in 0..6 {
        let case = draw(Seed(2), index);
        for (day, count) in [(&case.train, case.label.orders[0]), (&case.test, case.label.orders[1])] {
            let (decided, quantities) = (times(&day.orders, "decided_at"), whole(&day.orders, "qty"));
            assert!((200..900).contains(&count) && decided.len() == count, "{count} orders");
            assert!(decided.is_sorted() && quantities.iter().all(|quantity| *quantity > 0));
            let stamps = times(&day.quotes, "ts");
            assert!(stamps.is_sorted() && stamps[0] <= decided[0], "{:?}", case.label);
            let mut filled = vec![0; count];
            let fills = whole(&day.fills, "order_id").into_iter().zip(times(&day.fills, "filled_at"));
            for ((order, at), quantity) in fills.zip(whole(&day.fills, "qty")) {
                let order = order as usize - 1;
                filled[order] += quantity;
                assert!(at >= decided[order] && quantity > 0);
            }
            assert!(filled.iter().zip(&quantities).all(|(filled, quantity)| filled <= quantity));
            for name in ["bid", "ask"] {
                assert!(day.quotes.real(name).unwrap().iter().all(|price| *price > 1.0));
            }
            let crossed = day.quotes.real("bid").unwrap().iter().zip(day.quotes.real("ask").unwrap());
            assert!(crossed.into_iter().all(|(bid, ask)| bid <= ask));
        }
    }
}

/// The size that a label gives is what the log shows, computed from its tables: what fills cost beyond what the twin assumes is
/// the noise and the effect, nothing else.
#[test]
fn sizes_in_labels_are_those_in_the_tables() {
    for id in ["sqrt_impact", "half_spread", "volatility_slippage"] {
        let case = (0..20)
            .map(|seed| draw(Seed(seed), single(Seed(seed), id)))
            .find(|case| !case.label.rounded && case.label.depth != Depth::MidsOnly && case.label.effects[0].size > 1.0);
        let case = case.unwrap();
        let day = &case.train;
        let (stamps, decided) = (times(&day.quotes, "ts"), times(&day.orders, "decided_at"));
        let (bids, asks) = (day.quotes.real("bid").unwrap(), day.quotes.real("ask").unwrap());
        let Some(Column::Text(sides)) = day.orders.column("side") else { panic!("no sides") };
        let prices = day.fills.real("price").unwrap();
        let mut squares = 0.0;
        for (row, order) in whole(&day.fills, "order_id").iter().enumerate() {
            let order = *order as usize - 1;
            let quote = stamps.partition_point(|stamp| *stamp <= decided[order]) - 1;
            let (mid, sign) = (0.5 * (bids[quote] + asks[quote]), if sides[order] == "buy" { 1.0 } else { -1.0 });
            let touch = if sides[order] == "buy" { asks[quote] } else { bids[quote] };
            let assumed = if case.price == Assumed::Mid { mid } else { touch };
            squares += (sign * (prices[row] - assumed) / mid * 1e4).powi(2);
        }
        // The square of the cost is that of the effect and that of the noise, which is 1.
        let shown = squares / prices.len() as f64 / case.label.noise.powi(2);
        let expected = case.label.effects[0].size.powi(2) + 1.0;
        assert!((shown / expected - 1.0).abs() < 0.25, "{id}: {shown}, not {expected}; {:?}", case.label);
    }
}

/// Each effect does what its name says, seen in the tables.
#[test]
fn a_case_of_each_effect_really_has_it() {
    let of = |id: &str| draw(Seed(3), single(Seed(3), id));
    let lots = of("lot_size");
    let lot = lots.label.effects[0].parameters["lot"] as i64;
    let mut filled = std::collections::BTreeMap::new();
    for (order, quantity) in whole(&lots.train.fills, "order_id").into_iter().zip(whole(&lots.train.fills, "qty")) {
        *filled.entry(order).or_insert(0) += quantity;
    }
    assert!(lot > 1 && filled.values().all(|quantity| quantity % lot == 0), "{lot}");
    assert!(whole(&lots.train.orders, "qty").iter().any(|quantity| quantity % lot != 0));

    let fees = of("commission");
    let charged = fees.train.fills.real("fee").unwrap();
    assert!(charged.iter().sum::<f64>() > 0.0);
    assert!(charged.iter().all(|fee| (fee * 100.0 - (fee * 100.0).round()).abs() < 1e-9), "to the cent");

    let walked = of("book_walk");
    assert!(walked.train.fills.rows() > walked.label.orders[0] && walked.label.depth == Depth::FiveLevels);

    let stale = of("stale_quotes");
    let (seconds, decided) = (stale.label.effects[0].parameters["seconds"], times(&stale.train.orders, "decided_at"));
    let stamps = times(&stale.train.quotes, "ts");
    let seen = stale.train.orders.real("seen_bid").unwrap();
    let agreeing = (0..decided.len()).filter(|order| {
        let at = stamps.partition_point(|stamp| *stamp <= decided[*order] - (seconds * 1e9) as i64) - 1;
        stale.train.quotes.real("bid").unwrap()[at] == seen[*order]
    });
    assert!(agreeing.count() as f64 > 0.95 * decided.len() as f64);

    let capped = of("participation_cap");
    let day = &capped.train;
    let (stamps, decided) = (times(&day.quotes, "ts"), times(&day.orders, "decided_at"));
    let Some(Column::Text(sides)) = day.orders.column("side") else { panic!("no sides") };
    let mut ratios: Vec<f64> = Vec::new();
    for (order, filled) in whole(&day.fills, "order_id").into_iter().zip(whole(&day.fills, "qty")) {
        let order = order as usize - 1;
        let quote = stamps.partition_point(|stamp| *stamp <= decided[order]) - 1;
        let side = if sides[order] == "buy" { "ask" } else { "bid" };
        let sizes = ["", "2", "3", "4", "5"].map(|level| whole(&day.quotes, &format!("{side}{level}_size"))[quote]);
        if filled < whole(&day.orders, "qty")[order] {
            ratios.push(filled as f64 / sizes.iter().sum::<i64>() as f64);
        }
    }
    ratios.sort_by(f64::total_cmp);
    let (fraction, middle) = (capped.label.effects[0].parameters["fraction"], ratios[ratios.len() / 2]);
    assert!(ratios.len() > 10 && (middle / fraction - 1.0).abs() < 0.1, "{middle}, not {fraction}");

    let resting = of("queue_position");
    let Some(Column::Text(kinds)) = resting.train.orders.column("type") else { panic!("no types") };
    assert!(kinds.iter().any(|kind| kind == "limit") && kinds.iter().any(|kind| kind == "market"));
    let Some(Column::Text(liquidity)) = resting.train.fills.column("liquidity") else { panic!("no liquidity") };
    let makers = liquidity.iter().filter(|word| *word == "maker").count();
    assert!(makers > 20, "{makers} fills at rest");
}

/// Orders that were late paid the prices that came after their decisions: those of their latency, and neither of none nor of one
/// that is much longer.
#[test]
fn late_orders_pay_the_prices_that_came_later() {
    let plan = Plan { kind: Kind::Single, ids: vec!["command_delay"] };
    for seed in 0..4 {
        let set = Set::draw(&plan, Seed(seed));
        let scene = set.scene(0, set.effects());
        let outcome = scene.with(set.effects());
        let [Effect::Latency { seconds, .. }] = set.effects() else { panic!("no latency") };
        let error = |latency: f64| {
            let orders = scene.orders.iter().zip(&outcome.executions);
            let squares = orders.map(|(order, execution)| {
                let at = outcome.shown.partition_point(|shown| shown.time <= order.time + latency) - 1;
                let shown = &outcome.shown[at];
                let price = if scene.price == Assumed::Mid { shown.mid() } else { shown.touch(order.buys) as f64 };
                (execution.price().unwrap() - price).powi(2)
            });
            squares.sum::<f64>()
        };
        let right = error(*seconds);
        assert!(right < 0.8 * error(0.0) && right < error(6.0 * seconds), "{seconds} s of seed {seed}");
    }
}

/// In a market that reacts, what an order moved is on the tape; in one that does not, the tape is the same without the orders.
#[test]
fn tapes_react_where_they_are_said_to() {
    for id in ["permanent_impact", "transient_impact"] {
        for seed in 0..6 {
            let plan = Plan { kind: Kind::Single, ids: vec![id] };
            let set = Set::draw(&plan, Seed(seed));
            let scene = set.scene(0, &[]);
            let effect = set.effects()[0].clone();
            let (with, without) = (scene.with(std::slice::from_ref(&effect)), scene.with(&[]));
            let moved = with.shown.iter().zip(&without.shown).filter(|(with, without)| with.bid != without.bid).count();
            let reacts = scene.world == World::Live;
            assert_eq!(moved > 0, reacts, "{id} of seed {seed}");
            let channel = Channel::of(&effect, reacts);
            assert_eq!(channel == Channel::Mid, reacts);
            if !reacts {
                let [with, without] = [&with, &without].map(|outcome| Channel::Cost.shows(&scene, outcome));
                // The first order finds nothing, and pays half of what it leaves.
                let (Effect::Displacement { bps, power, .. }, order) = (&effect, &scene.orders[0]) else { panic!("none") };
                let own = 0.5 * bps * (order.quantity / scene.middle).powf(*power);
                let paid = with[0].unwrap() - without[0].unwrap();
                assert!((paid / own - 1.0).abs() < 1e-3, "{paid}, not {own}");
            }
        }
    }
}

/// Twins do not tell: what they say is near the truth, and the same whatever is concealed.
#[test]
fn twins_say_nothing_of_what_is_concealed() {
    for index in 0..8 {
        let case = draw(Seed(4), index);
        let label = &case.label;
        let off = [case.average_daily_volume / label.average_daily_volume, case.daily_volatility / label.daily_volatility];
        let most: f64 = if label.kind == Kind::Null(Null::MisSet) { 3.1 } else { 1.25 };
        // A volatility of a market that hardly moves is written down with few digits.
        let told = off.iter().filter(|_| label.daily_volatility > 1e-3);
        assert!(told.into_iter().all(|off| (1.0 / most..most).contains(off)), "{off:?} in {label:?}");
        assert!((case.tick - 0.01).abs() < 1e-12 && case.lot.is_none_or(|lot| lot == 1.0));
        let columns: Vec<&str> = case.train.orders.columns().iter().map(|(name, _)| name.as_str()).collect();
        assert!(columns.starts_with(&["order_id", "symbol", "decided_at", "side", "qty", "type", "limit_price"]));
    }
}

/// What is not excited is not in the costs, or could as well be something else.
#[test]
fn what_is_not_reached_is_there_on_another_day_or_looks_like_something_else() {
    let of = |id: &'static str| Set::draw(&Plan { kind: Kind::NotExcited, ids: vec![id] }, Seed(8));
    for id in ["participation_cap", "lot_size", "command_delay"] {
        let size = of(id).sizes()[0];
        assert!(size < 1.0, "{id} is seen: {size}");
    }
    let one = of("sqrt_impact");
    assert!(one.scene(0, &[]).orders.windows(2).all(|pair| pair[0].quantity == pair[1].quantity));
    let apart = of("transient_impact");
    assert!(apart.scene(0, &[]).orders.windows(2).all(|pair| pair[1].time - pair[0].time > 20.0));
}
