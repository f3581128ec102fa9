//! The execution plant and its mechanisms on a log in which everything is known.
#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::sync::Arc;

use trueup::market::{
    Bar, Execution, InFlight, Instrument, Level, LogError, LogMarket, LoggedFill, LoggedOrder, MECHANISMS, OrderLog,
    OrderType, Price, PriceAssumption, Print, Quotes, Role, ShownDelay, Side, Tape,
};
use trueup::sim2real::{
    Assembly, Candidate, Plant, Recording, Seed, Simulator, Thetas, Timestamp, Twin, Typical, check_mechanism, check_plant,
};

const SECOND: i64 = Timestamp::NANOS;
const DELAY: i64 = 200_000_000;
const ORDERS: i64 = 40;

fn at(seconds: i64) -> Timestamp {
    Timestamp(1_700_000_000 * SECOND + seconds * SECOND)
}

fn instrument() -> Instrument {
    Instrument {
        symbol: "XYZ".into(),
        tick_size: 0.01,
        lot_size: 1.0,
        average_daily_volume: Some(1e6),
        daily_volatility: Some(0.02),
    }
}

fn level(price: f64, size: f64) -> Level {
    Level { price, size }
}

/// Mid in second `k`: it wanders by whole cents.
fn mid(k: i64) -> f64 {
    100.0 + 0.01 * ((k * 7) % 11) as f64
}

/// Three levels a side; the spread is 2 or 4 cents, the touch holds 30.
fn levels(k: i64) -> ([Level; 3], [Level; 3]) {
    let half = if k % 3 == 0 { 0.02 } else { 0.01 };
    let side = |sign: f64| [0.0, 0.02, 0.03].map(|deeper| level(mid(k) + sign * (half + deeper), 30.0));
    (side(-1.0), side(1.0))
}

/// An order every ten seconds, decided on the book of that second and filled at the one of 0.1 s later, which is in
/// force when it arrives after 0.2 s.
fn order(k: i64) -> LoggedOrder {
    LoggedOrder {
        id: format!("o{k}"),
        side: if k % 2 == 0 { Side::Buy } else { Side::Sell },
        quantity: [20.0, 45.0, 75.0][(k % 3) as usize],
        decided_at: at(10 * k),
        kind: OrderType::Market,
        seen_mid: None,
    }
}

/// The levels order `k` takes: price and quantity.
fn pieces(k: i64) -> Vec<(f64, f64)> {
    let (bids, asks) = levels(10 * k + 1);
    let mut left = order(k).quantity;
    let taken = if order(k).side == Side::Buy { asks } else { bids }.map(|level| {
        let quantity = level.size.min(left);
        left -= quantity;
        (level.price, quantity)
    });
    taken.into_iter().filter(|(_, quantity)| *quantity > 0.0).collect()
}

fn fills() -> Vec<LoggedFill> {
    let fill = |k: i64| {
        pieces(k).into_iter().map(move |(price, quantity)| LoggedFill {
            order_id: format!("o{k}"),
            filled_at: at(10 * k) + 2 * DELAY,
            quantity,
            price,
            fee: 0.5e-4 * price * quantity,
        })
    };
    (0..ORDERS).flat_map(fill).collect()
}

fn quotes() -> Quotes {
    let mut quotes = Quotes::with_depth(3);
    for k in 0..10 * ORDERS {
        let (bids, asks) = levels(k);
        if k % 10 == 1 {
            // The next book comes 0.1 s after a decision; at the arrival stamp the order's own impact is to be seen.
            quotes.push(at(k - 1) + DELAY / 2, &bids, &asks);
            quotes.push(at(k - 1) + DELAY, &[level(90.0, 1.0)], &[level(110.0, 1.0)]);
        }
        quotes.push(at(k), &bids, &asks);
    }
    quotes
}

fn prints() -> Vec<Print> {
    let print = |k: i64| {
        pieces(k).into_iter().map(move |(price, size)| Print {
            time: at(10 * k) + DELAY,
            price,
            size,
            aggressor: Some(order(k).side),
        })
    };
    (0..ORDERS).flat_map(print).collect()
}

fn log(
    tape: Tape,
    price: PriceAssumption,
    orders: &[LoggedOrder],
    fills: &[LoggedFill],
) -> Result<Recording<OrderLog>, LogError> {
    OrderLog::recording(
        "synthetic",
        LogMarket { instrument: instrument(), tape: Arc::new(tape), price, shows_own_orders: None },
        orders,
        fills,
    )
}

fn orders() -> Vec<LoggedOrder> {
    (0..ORDERS).map(order).collect()
}

fn full() -> Recording<OrderLog> {
    log(Tape::new(quotes(), prints(), Vec::new()), PriceAssumption::Mid, &orders(), &fills()).unwrap()
}

/// The same orders on a tape of bars of ten seconds.
fn on_bars(price: PriceAssumption) -> Recording<OrderLog> {
    let bar = |k: i64| {
        let [open, close] = [mid(10 * k), mid(10 * k + 9)].map(|price| Price::nearest(price).unwrap());
        let (high, low) = (open.max(close), open.min(close));
        Bar { open_at: at(10 * k), known_at: at(10 * k + 10), open, high, low, close, volume: 400.0 }
    };
    log(Tape::new(Quotes::default(), Vec::new(), (-1..ORDERS + 1).map(bar).collect()), price, &orders(), &fills()).unwrap()
}

/// Orders that take and that rest, each on its way for 0.2 s, and positions long and short, charged for ten hours each: all
/// that any row of the registry may act on.
fn planned() -> Recording<OrderLog> {
    let tape = Arc::new(Tape::new(quotes(), prints(), Vec::new()));
    let market = LogMarket { instrument: instrument(), tape, price: PriceAssumption::Mid, shows_own_orders: None };
    let recording = full();
    let sent = recording.stimulus.orders().iter().enumerate().map(|(k, order)| match k % 4 {
        0 | 1 => order.arriving(order.decided_at + DELAY),
        2 => order.as_a(Role::Maker),
        _ => {
            // Every other of the positions is short.
            let side = if k % 8 == 3 { Side::Sell } else { Side::Buy };
            let held = InFlight { side, ..*order };
            held.as_a(Role::Holder).arriving(order.decided_at + 36_000 * SECOND)
        }
    });
    OrderLog::planned("planned", market, sent.collect())
}

fn with(
    assembly: Assembly<Execution>,
    recording: &Recording<OrderLog>,
    name: &str,
    form: &str,
    value: f64,
) -> Assembly<Execution> {
    let candidates = assembly.candidates(std::slice::from_ref(recording));
    let found: &Candidate = candidates.iter().find(|c| c.about.name == name && c.form.name == form).unwrap();
    let mut values: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).collect();
    values.push(value);
    assembly.with(found).with_values(&values)
}

/// Largest distance between a measured and a simulated channel.
fn worst(assembly: &Assembly<Execution>, recording: &Recording<OrderLog>, channel: &str) -> f64 {
    let values: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).collect();
    let trajectory = assembly.rollout(&Thetas::single(&values), recording, 0..recording.len(), Seed(1)).remove(0);
    let simulated = trajectory.into_iter().find(|s| s.channel == channel).unwrap().samples;
    let measured = &recording.channel(channel).unwrap().samples;
    measured.iter().zip(simulated).filter_map(|(m, s)| Some((m.as_ref()? - s).abs())).fold(0.0, f64::max)
}

fn bare() -> Assembly<Execution> {
    Assembly::new(Execution, MECHANISMS)
}

#[test]
fn the_plant_and_every_row_of_the_registry_keep_their_contracts() {
    // What a log of market orders, which arrive as they are decided, has nothing of.
    let of_others = ["adverse_selection", "borrow_fee", "funding", "volatility_slippage", "commission"];
    for recording in [planned(), full(), on_bars(PriceAssumption::BarClose), on_bars(PriceAssumption::NextOpen)] {
        check_plant(&Execution, MECHANISMS, &recording).unwrap();
        for mechanism in MECHANISMS {
            let name = mechanism.about().name;
            // The delays it starts at are shorter than the bars: no close is missed by them.
            let missed = recording.stimulus.price() == PriceAssumption::BarClose && name == "command_delay";
            if recording.name == "planned" || !missed && !of_others.contains(&name) {
                check_mechanism(*mechanism, &Execution, MECHANISMS, &recording).unwrap();
            }
        }
    }
}

#[test]
fn what_takers_pay_is_no_cost_of_those_who_rest_and_only_positions_are_charged_for_time() {
    let recording = planned();
    let orders = recording.stimulus.orders();
    let bare = bare().rollout(&Thetas::single(&[]), &recording, 0..recording.len(), Seed(1)).remove(0);
    let typical = Execution.typical(std::slice::from_ref(&recording));
    for mechanism in MECHANISMS {
        let about = mechanism.about();
        for (form, stated) in mechanism.forms(&typical).into_iter().enumerate() {
            let values: Vec<f64> = stated.parameters.iter().map(|p| p.starts.last().copied().unwrap_or(p.nominal)).collect();
            let with = Assembly::new(Execution, MECHANISMS).with_mechanism(*mechanism, form, stated.parameters);
            let found = with.rollout(&Thetas::single(&values), &recording, 0..recording.len(), Seed(1)).remove(0);
            let touches = |role: Role| {
                let of_role = (0..recording.len()).filter(|row| orders[*row].role == role);
                of_role.into_iter().any(|row| (0..3).any(|k| found[k].samples[row] != bare[k].samples[row]))
            };
            let touched = [Role::Taker, Role::Maker, Role::Holder].map(touches);
            let expected = match about.name {
                "commission" | "lot_size" | "participation_cap" => [true, true, false],
                "adverse_selection" | "queue_position" => [false, true, false],
                "borrow_fee" | "funding" => [false, false, true],
                // Here nothing says what was seen.
                "stale_quotes" => [false; 3],
                // No cost of its own: whoever comes later meets another book.
                "command_delay" => continue,
                _ => [true, false, false],
            };
            assert_eq!(touched, expected, "{} {}: takers, makers, holders", about.name, stated.name);
        }
    }
}

#[test]
fn what_earlier_rows_left_is_met_by_a_run_that_starts_in_the_middle() {
    let recording = full();
    for (name, form, values) in
        [("permanent_impact", 0, vec![5e3]), ("permanent_impact", 1, vec![500.0]), ("transient_impact", 0, vec![5e3, 600.0])]
    {
        let mechanism = MECHANISMS.iter().find(|m| m.about().name == name).unwrap();
        let parameters = mechanism.forms(&Typical::default())[form].parameters.clone();
        let assembly = bare().with_mechanism(*mechanism, form, parameters);
        let follow =
            |rows| assembly.rollout(&Thetas::single(&values), &recording, rows, Seed(1)).remove(0).remove(0).samples;
        let whole = follow(0..recording.len());
        assert_eq!(follow(25..recording.len()), whole[25..], "{name}");
        assert!((whole[25] - follow(25..26)[0]).abs() == 0.0 && whole[25].abs() > 0.01, "{name}: {}", whole[25]);
    }
}

#[test]
fn spread_walk_delay_and_commission_add_up_to_what_was_paid() {
    let recording = full();
    let log = &recording.stimulus;
    assert!((log.shown_delay().and_then(ShownDelay::constant).unwrap() - 0.2).abs() < 1e-9, "{:?}", log.shown_delay());
    assert!(log.own_prints().iter().all(Option::is_some));
    assert_eq!(log.notes(), ["the tape shows what the orders of the log did to the market"]);
    let whole = with(bare(), &recording, "half_spread", "fraction", 1.0);
    let whole = with(whole, &recording, "book_walk", "", 1.0);
    let whole = with(whole, &recording, "commission", "bps", 0.5);
    assert!(worst(&whole, &recording, "cost") > 0.1, "without the delay it does not add up");
    let delayed = with(whole.clone(), &recording, "command_delay", "", 0.2);
    assert!(worst(&delayed, &recording, "cost") < 1e-9);
    assert!(worst(&delayed, &recording, "fee") < 1e-9);
    assert_eq!(worst(&delayed, &recording, "filled"), 0.0);
    assert!(worst(&bare(), &recording, "fee") > 0.49);
    // The own prints keep a delay that is too long from finding the order's own impact.
    let late = with(whole, &recording, "command_delay", "", 0.9);
    assert!(worst(&late, &recording, "cost") < 1e-9);
}

#[test]
fn without_prints_the_own_impact_is_met_by_a_delay_that_is_too_long() {
    let recording = log(Tape::new(quotes(), Vec::new(), Vec::new()), PriceAssumption::Mid, &orders(), &fills()).unwrap();
    assert_eq!(recording.stimulus.shown_delay(), None);
    let whole = with(bare(), &recording, "half_spread", "fraction", 1.0);
    let whole = with(whole, &recording, "book_walk", "", 1.0);
    // Strictly before its arrival: the row stamped 0.2 s after the decision is not met at a delay of 0.2 s.
    assert!(worst(&with(whole.clone(), &recording, "command_delay", "", 0.2), &recording, "cost") < 1e-9);
    assert!(worst(&with(whole, &recording, "command_delay", "", 0.200_001), &recording, "cost") > 1.0);
}

#[test]
fn a_cap_fills_the_part_of_the_displayed_size_it_allows() {
    let recording = full();
    let capped = with(bare(), &recording, "participation_cap", "", 0.5);
    let trajectory = capped.rollout(&Thetas::single(&[0.5]), &recording, 0..3, Seed(1)).remove(0);
    // 90 are displayed on each side, so 45 can be filled of 20, 45 and 75.
    assert_eq!(trajectory[2].samples, [1.0, 1.0, 0.6]);
}

#[test]
fn impacts_are_what_their_laws_say() {
    let recording = full();
    let cost = |name: &str| {
        let assembly = with(bare(), &recording, name, "", 100.0);
        assembly.rollout(&Thetas::single(&[100.0]), &recording, 0..1, Seed(1)).remove(0)[0].samples[0]
    };
    let participation = 20.0 / 1e6_f64;
    assert!((cost("sqrt_impact") - 100.0 * participation.sqrt()).abs() < 1e-9);
    assert!((cost("linear_impact") - 100.0 * participation).abs() < 1e-9);
}

#[test]
fn forms_apply_where_the_data_know_what_they_need() {
    let forms = |recording: &Recording<OrderLog>| -> Vec<String> {
        let candidates = bare().candidates(std::slice::from_ref(recording));
        candidates.iter().map(|c| format!("{}.{}", c.about.name, c.form.name)).collect()
    };
    let quoted = forms(&full());
    assert!(quoted.contains(&"half_spread.fraction".into()) && quoted.contains(&"book_walk.".into()));
    assert!(!quoted.contains(&"half_spread.bps".into()));
    let bars = forms(&on_bars(PriceAssumption::BarClose));
    assert!(bars.contains(&"half_spread.bps".into()) && bars.contains(&"participation_cap.".into()));
    assert!(!bars.contains(&"half_spread.fraction".into()) && !bars.contains(&"book_walk.".into()));
    // A log of market orders knows no queue.
    assert!(!quoted.contains(&"queue_position.".into()) && forms(&planned()).contains(&"queue_position.".into()));
}

#[test]
fn the_delay_the_stamps_show_is_where_fits_begin() {
    let candidates = bare().candidates(&[full()]);
    let delay = candidates.iter().find(|c| c.about.name == "command_delay").unwrap();
    assert!((delay.form.parameters[0].starts[0] - 0.2).abs() < 1e-9);
    assert_eq!(Execution.typical(&[on_bars(PriceAssumption::BarClose)]).delay, None);
}

#[test]
fn resolutions_are_those_of_tick_cent_and_lot() {
    let recording = full();
    let order = &recording.stimulus.orders()[0];
    let cost = Execution::resolution_of(&recording, "cost");
    assert!((cost - 0.01 / 12.0_f64.sqrt() / order.mid * 1e4).abs() < 1e-3 * cost);
    let fee = Execution::resolution_of(&recording, "fee");
    assert!((fee - 0.005 / (45.0 * order.mid) * 1e4).abs() < 1e-2 * fee);
    assert_eq!(Execution::resolution_of(&recording, "filled"), 0.5 / 45.0);
    assert_eq!(Execution::resolution_of(&recording, "nothing"), 0.0);
}

#[test]
fn covariates_have_a_value_an_order_and_rank_the_future_last() {
    let recording = full();
    let covariates = Execution.covariates(&recording);
    assert_eq!(covariates.len(), 27);
    assert!(covariates.iter().all(|(_, values)| values.len() == recording.len() && values.iter().all(|v| v.is_finite())));
    let of = |name: &str| covariates.iter().find(|(n, _)| *n == name).unwrap().1[..3].to_vec();
    assert_eq!(of("quantity / size at the touch"), [20.0 / 30.0, 1.5, 2.5]);
    assert!(of("gap to the second level").iter().all(|gap| (gap - 0.02).abs() < 1e-9));
    assert!(covariates.iter().rev().take(2).all(|(name, _)| name.ends_with("after")));
    assert!(Execution.covariates(&on_bars(PriceAssumption::BarClose)).iter().all(|(name, _)| !name.contains("touch")));
}

#[test]
fn orders_beyond_the_displayed_book_or_unfilled_have_no_cost() {
    let mut orders = orders();
    orders[2].quantity = 200.0;
    orders.push(LoggedOrder { id: "rests".into(), kind: OrderType::Other("limit".into()), ..order(5) });
    let fills: Vec<LoggedFill> = fills().into_iter().filter(|fill| fill.order_id != "o1").collect();
    let recording = log(Tape::new(quotes(), prints(), Vec::new()), PriceAssumption::Mid, &orders, &fills).unwrap();
    let sample = |channel: &str, row: usize| recording.channel(channel).unwrap().samples[row];
    assert_eq!((sample("cost", 1), sample("fee", 1), sample("filled", 1)), (None, None, Some(0.0)));
    assert_eq!((sample("cost", 2), sample("filled", 2)), (None, None));
    assert!(sample("cost", 0).is_some() && sample("fee", 2).is_some());
    let notes = recording.stimulus.notes().join("\n");
    for part in ["1 of 40 orders are larger", "1 of 40 orders were not filled", "1 of 41 orders are not market orders"] {
        assert!(notes.contains(part), "{notes}");
    }
}

#[test]
fn orders_off_the_tape_are_an_error_that_says_by_how_much() {
    let tape = || Tape::new(quotes(), prints(), Vec::new());
    let shifted = |seconds: i64| {
        let orders: Vec<_> =
            (0..ORDERS).map(|k| LoggedOrder { decided_at: order(k).decided_at + seconds * SECOND, ..order(k) }).collect();
        log(tape(), PriceAssumption::Mid, &orders, &[]).unwrap_err().to_string()
    };
    let early = shifted(-5 * 3600);
    assert!(
        early.contains("40 of 40 orders are outside the tape; this one is decided 18000.000 s before the tape begins"),
        "{early}"
    );
    assert!(
        early.contains("row 1, column `decided_at`") && early.contains("hint: is one of the files in another zone, 5 h")
    );
    assert!(shifted(4 * 3600).contains("after the tape ends"));
    assert!(shifted(-1_600_000_000).contains("time_unit"));
    let nothing = log(Tape::default(), PriceAssumption::Mid, &orders(), &[]).unwrap_err().to_string();
    assert!(nothing.contains("there are no quotes"), "{nothing}");
    let limit = LoggedOrder { kind: OrderType::Other("limit".into()), ..order(0) };
    let none = log(tape(), PriceAssumption::Mid, &[limit], &[]).unwrap_err().to_string();
    assert!(none.contains("none of the 1 orders is a market order, or a limit order that rested and was filled"), "{none}");
    let last = log(Tape::new(quotes(), Vec::new(), Vec::new()), PriceAssumption::Last, &orders(), &[]).unwrap_err();
    assert!(last.to_string().contains("there are no trades"), "{last}");
}
