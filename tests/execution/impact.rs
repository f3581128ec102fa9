//! Impact that own orders meet again, simulated by other means than the laws': in small steps or by the sum over all that was
//! traded, slice by slice. Concealed from the twin, it is to be named, with its constants: from what later orders pay on a tape that
//! does not know of them, or from what the mid of a tape does that shows them.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use trueup::market::{
    Execution, Instrument, Level, LogMarket, LoggedFill, LoggedOrder, MECHANISMS, OrderLog, OrderType, PriceAssumption,
    Quotes, Side, Tape,
};
use trueup::sim2real::diagnose::{Diagnosis, Verdict, diagnose};
use trueup::sim2real::{Assembly, Recording, Seed, Timestamp};

use crate::draws::Draws;

const DAILY_VOLUME: f64 = 1e6;
/// Step of the simulation [s].
const STEP: f64 = 0.05;
/// Parts in which an order is executed: each meets what those before it have moved.
const SLICES: usize = 400;
/// Standard deviation of what the price of a fill is off by, whatever the law [bps].
const NOISE: f64 = 0.3;
const ORDERS: usize = 420;

/// What is left of a displacement.
#[derive(Clone, Copy)]
enum Memory {
    /// None of it.
    Gone,
    /// All of it.
    Stays,
    /// It falls at a rate in proportion to itself, with this time constant [s].
    Decays(f64),
    /// The power of one plus the time over a lag [s].
    Fades { lag: f64, exponent: f64 },
}

/// What the market does to those who take: what a day's volume displaces [bps], and how long that lasts.
#[derive(Clone, Copy)]
struct Impact {
    bps: f64,
    memory: Memory,
    /// Whether the tape shows it: orders then pay no more than what is quoted.
    shown: bool,
    /// What the mid does within a minute of a decision, in the direction of the order, whether or not anything is traded [bps].
    foreseen: f64,
}

impl Impact {
    fn unseen(bps: f64, memory: Memory) -> Self {
        Self { bps, memory, shown: false, foreseen: 0.0 }
    }

    fn shown(bps: f64, memory: Memory) -> Self {
        Self { shown: true, ..Self::unseen(bps, memory) }
    }
}

/// The time over which what is foreseen comes true [s].
const MINUTE: f64 = 60.0;

/// A child order: the step in which it is decided and filled, its sign and its quantity.
struct Child {
    step: usize,
    sign: f64,
    quantity: f64,
}

/// Parents of 3 to 8 children that follow each other within a minute, with pauses between parents.
fn children(draws: &mut Draws) -> Vec<Child> {
    let (mut children, mut time) = (Vec::new(), 5.0);
    while children.len() < ORDERS {
        let sign = if draws.uniform() < 0.5 { 1.0 } else { -1.0 };
        for _ in 0..draws.between(3.0, 9.0) as usize {
            let quantity = draws.between(500.0, 4_000.0).round();
            children.push(Child { step: (time / STEP) as usize, sign, quantity });
            time += draws.between(2.0, 60.0);
        }
        time += draws.between(20.0, 400.0);
    }
    children.truncate(ORDERS);
    children
}

/// A log of orders filled at the touch, moved by what own orders displace.
fn log(impact: Impact, seed: u64) -> Recording<OrderLog> {
    let mut draws = Draws(seed);
    let children = children(&mut draws);
    let at = |step: usize| Timestamp(1_722_951_000 * Timestamp::NANOS + (step as f64 * STEP * 1e9).round() as i64);
    let steps = children.last().unwrap().step + 100;
    let (mut quotes, mut orders, mut fills) = (Quotes::with_depth(1), Vec::new(), Vec::new());
    let (mut ticks, mut displaced, mut next) = (5_000_i64, 0.0_f64, 0);
    // What was displaced, and when [s]: for memories that are no equation of one state.
    let mut past: Vec<(f64, f64)> = Vec::new();
    let (mut foreseen, mut shown) = (0.0, (0, 0));
    for step in 0..steps {
        let now = step as f64 * STEP;
        if step % 40 == 0 {
            ticks += [0, 0, 1, -1][(draws.uniform() * 4.0) as usize];
        }
        if impact.foreseen != 0.0 {
            let under_way = children.iter().filter(|c| (0.0..MINUTE).contains(&(now - c.step as f64 * STEP)));
            foreseen += under_way.map(|child| child.sign * impact.foreseen * STEP / MINUTE).sum::<f64>();
        }
        // A mid of 50 moves a tick of 0.01 by 2 bps.
        let moved = if impact.shown { foreseen + displaced } else { foreseen };
        let quoted = (ticks + (moved / 2.0).round() as i64, step / 40);
        if step == 0 || quoted != shown {
            shown = quoted;
            let price = |tick: i64| (quoted.0 + tick) as f64 * 0.01;
            quotes.push(at(step), &[Level { price: price(-1), size: 5e4 }], &[Level { price: price(1), size: 5e4 }]);
        }
        if let (Memory::Fades { lag, exponent }, true) = (impact.memory, impact.shown) {
            displaced = past.iter().map(|(when, size)| size * (1.0 + (now - when) / lag).powf(-exponent)).sum();
        }
        match impact.memory {
            Memory::Gone => displaced = 0.0,
            Memory::Decays(time_constant) => displaced -= STEP * displaced / time_constant,
            Memory::Stays | Memory::Fades { .. } => {}
        }
        while let Some(child) = children.get(next).filter(|child| child.step == step) {
            if let Memory::Fades { lag, exponent } = impact.memory {
                displaced = past.iter().map(|(when, size)| size * (1.0 + (now - when) / lag).powf(-exponent)).sum();
            }
            let (own, mut paid) = (child.sign * impact.bps * child.quantity / DAILY_VOLUME, 0.0);
            for _ in 0..SLICES {
                paid += displaced / SLICES as f64;
                displaced += own / SLICES as f64;
            }
            past.push((now, own));
            let mid = shown.0 as f64 * 0.01;
            let paid = if impact.shown { 0.0 } else { paid };
            let price = mid + child.sign * 0.01 + mid * (paid + NOISE * draws.bell()) * 1e-4;
            let id = format!("c{next}");
            let side = if child.sign > 0.0 { Side::Buy } else { Side::Sell };
            orders.push(LoggedOrder {
                id: id.clone(),
                side,
                quantity: child.quantity,
                decided_at: at(step),
                kind: OrderType::Market,
                seen_mid: None,
            });
            let filled_at = at(step) + 1_000;
            fills.push(LoggedFill { order_id: id, filled_at, quantity: child.quantity, price, fee: 0.0 });
            next += 1;
        }
    }
    let instrument = Instrument {
        symbol: "XYZ".into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: Some(DAILY_VOLUME),
        daily_volatility: Some(0.02),
    };
    let tape = Arc::new(Tape::new(quotes, Vec::new(), Vec::new()));
    OrderLog::recording(
        "simulated",
        LogMarket { instrument, tape, price: PriceAssumption::Touch, shows_own_orders: None },
        &orders,
        &fills,
    )
    .unwrap()
}

fn diagnosed(impact: Impact, seed: u64) -> Diagnosis {
    let twin = Assembly::new(Execution, MECHANISMS);
    diagnose(&twin, &[log(impact, seed)], &[], Seed(1), &|_, _, _| ()).diagnosis
}

fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.effects.iter().map(|effect| effect.mechanism.as_str()).collect()
}

/// Holds the parameter of the first effect to be `truth`, within three standard deviations that are no more than `part` of it.
fn holds(diagnosis: &Diagnosis, parameter: &str, truth: f64, part: f64) {
    let found = &diagnosis.effects[0].parameters[parameter];
    println!("{}: {parameter} {} +- {}, in truth {truth}", diagnosis.effects[0].mechanism, found.value, found.std);
    assert!((found.value - truth).abs() <= 3.0 * found.std, "{parameter}: {found:?}, in truth {truth}");
    assert!(found.std <= part * truth, "{parameter}: {found:?} says little");
}

#[test]
fn impact_that_decays_is_named_with_its_size_and_its_time() {
    for (seed, bps, recovery) in [(11, 4_000.0, 30.0), (12, 2_500.0, 120.0), (13, 6_000.0, 8.0)] {
        let diagnosis = diagnosed(Impact::unseen(bps, Memory::Decays(recovery)), seed);
        println!("{}", diagnosis.summary);
        assert_eq!((names(&diagnosis), diagnosis.verdict), (vec!["transient_impact"], Verdict::Named), "{diagnosis:#?}");
        holds(&diagnosis, "bps_at_full_participation", bps, 0.12);
        holds(&diagnosis, "recovery", recovery, 0.25);
    }
}

#[test]
fn impact_that_fades_as_a_power_is_named_and_stated_as_one() {
    let diagnosis = diagnosed(Impact::unseen(6_000.0, Memory::Fades { lag: 4.0, exponent: 0.5 }), 21);
    println!("{}", diagnosis.summary);
    assert_eq!((names(&diagnosis), diagnosis.verdict), (vec!["transient_impact"], Verdict::Named), "{diagnosis:#?}");
    holds(&diagnosis, "bps_at_full_participation", 6_000.0, 0.2);
    holds(&diagnosis, "exponent", 0.5, 0.5);
}

#[test]
fn what_stays_and_what_is_gone_at_once_are_not_called_transient() {
    let stays = diagnosed(Impact::unseen(3_000.0, Memory::Stays), 31);
    println!("{}", stays.summary);
    assert_eq!(names(&stays), ["permanent_impact"], "{stays:#?}");
    holds(&stays, "bps_at_full_participation", 3_000.0, 0.12);
    let gone = diagnosed(Impact::unseen(5_000.0, Memory::Gone), 32);
    println!("{}", gone.summary);
    assert_eq!(names(&gone), ["linear_impact"], "{gone:#?}");
    // An order pays half of what it moves.
    holds(&gone, "bps_at_full_participation", 2_500.0, 0.12);
}

#[test]
fn where_own_orders_move_nothing_no_impact_is_named() {
    for seed in [41, 42] {
        let nothing = diagnosed(Impact::unseen(0.0, Memory::Gone), seed);
        assert_eq!((names(&nothing), nothing.verdict), (vec![], Verdict::NoMismatch), "{}", nothing.summary);
    }
}

#[test]
fn impact_that_the_tape_shows_is_named_from_its_mids_and_costs_nothing_besides() {
    for (seed, memory, name) in [
        (51, Memory::Decays(30.0), "transient_impact"),
        (52, Memory::Stays, "permanent_impact"),
        (53, Memory::Fades { lag: 4.0, exponent: 0.5 }, "transient_impact"),
    ] {
        let diagnosis = diagnosed(Impact::shown(4_000.0, memory), seed);
        println!("{}", diagnosis.summary);
        assert_eq!((names(&diagnosis), diagnosis.verdict), (vec![name], Verdict::Named), "{diagnosis:#?}");
        assert!(diagnosis.effects[0].parameters["paid"].value == 0.0);
        holds(&diagnosis, "bps_at_full_participation", 4_000.0, 0.2);
        if let Memory::Decays(recovery) = memory {
            holds(&diagnosis, "recovery", recovery, 0.4);
        }
        let mid = diagnosis.fit.iter().find(|fit| fit.channel == "mid").unwrap();
        assert!(mid.improvement_ci95[0] > 0.0, "{mid:?}");
    }
}

#[test]
fn what_orders_foresaw_is_no_impact() {
    for (seed, foreseen) in [(61, 4.0), (62, -4.0), (63, 10.0)] {
        let nothing = Impact { foreseen, ..Impact::shown(0.0, Memory::Gone) };
        let diagnosis = diagnosed(nothing, seed);
        assert_eq!((names(&diagnosis), diagnosis.verdict), (vec![], Verdict::NoMismatch), "{}", diagnosis.summary);
    }
    let both = Impact { foreseen: 6.0, ..Impact::shown(4_000.0, Memory::Stays) };
    let diagnosis = diagnosed(both, 64);
    assert_eq!(names(&diagnosis), ["permanent_impact"], "{}", diagnosis.summary);
    let bps = diagnosis.effects[0].parameters["bps_at_full_participation"].value;
    // A part of what is foreseen comes between a decision and the look after its fill.
    assert!((bps / 4_000.0 - 1.0).abs() < 0.1, "{bps}");
}
