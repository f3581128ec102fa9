//! The rows of a log that can be followed: the orders that are modelled and of which the tape tells, and what became of them.

use std::borrow::Cow;

use crate::sim2real::Timestamp;

use super::recent;
use super::{
    InFlight, LogError, LogMarket, LogTable, LoggedFill, LoggedOrder, OrderType, Piece, Role, Seen, Tape, own_print,
};

/// The largest part of a log that may be left out because the tape does not tell of it.
const LEFT_OUT: f64 = 0.01;

/// What became of one order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Outcome {
    /// Its fills.
    pub pieces: Vec<Piece>,
    /// When the first of them was reported.
    pub first_fill: Option<Timestamp>,
    /// What was filled [units].
    pub quantity: f64,
    /// What changed hands [currency].
    pub notional: f64,
    /// What was charged [currency].
    pub fee: f64,
    /// Average price [currency], where anything was filled.
    pub price: Option<f64>,
}

impl Outcome {
    pub fn of(order: &InFlight, fills: &[&LoggedFill]) -> Self {
        let quantity: f64 = fills.iter().map(|fill| fill.quantity).sum();
        // Summed as distances from the mid, so that the average of equal prices is that price to the last digits.
        let beyond: f64 = fills.iter().map(|fill| fill.quantity * (fill.price - order.mid)).sum();
        Self {
            pieces: fills.iter().map(|fill| Piece { quantity: fill.quantity, price: fill.price }).collect(),
            first_fill: fills.first().map(|fill| fill.filled_at),
            quantity,
            notional: fills.iter().map(|fill| fill.quantity * fill.price).sum(),
            fee: fills.iter().map(|fill| fill.fee).sum(),
            price: (quantity > 0.0).then(|| order.mid + beyond / quantity),
        }
    }
}

/// Fees are taken for rounded to cents where all are so many whole ones, to within this.
const WHOLE: f64 = 1e-6;
/// A fee whose rounding is so many times the usual says nothing in bps.
const COARSE: f64 = 3.0;

/// Leaves out of `fees` [bps] those of `notional`s [currency] so small that their rounding to a cent is most of them.
pub(super) fn forget_rounded(fees: &mut [Option<f64>], notional: &[f64]) {
    let charged = |(fee, notional): (&Option<f64>, &f64)| fee.map(|fee| fee * notional * 1e-4);
    let whole = |fee: f64| (100.0 * fee - (100.0 * fee).round()).abs() < WHOLE;
    if !fees.iter().zip(notional).filter_map(charged).all(whole) {
        return;
    }
    let mut known: Vec<f64> = fees.iter().zip(notional).filter_map(|(fee, notional)| fee.map(|_| *notional)).collect();
    known.sort_by(f64::total_cmp);
    let Some(median) = known.get(known.len() / 2).copied() else { return };
    for (fee, notional) in fees.iter_mut().zip(notional) {
        if *notional < median / COARSE {
            *fee = None;
        }
    }
}

/// A log whose stamps are what they most likely were: those that were cut to a second, in the middle of it.
pub(super) struct Stamps<'a> {
    pub orders: Cow<'a, [LoggedOrder]>,
    pub fills: Cow<'a, [LoggedFill]>,
    /// By how much they are later than in the log [ns].
    pub early: i64,
}

/// With fewer orders whole seconds may be chance, or a habit.
const ENOUGH: usize = 25;

impl<'a> Stamps<'a> {
    /// Of `orders` and `fills` as the log has them. Beside a `tape` of whole seconds too, as bars are, nothing was cut.
    pub fn of(orders: &'a [LoggedOrder], fills: &'a [LoggedFill], tape: &Tape, notes: &mut Vec<String>) -> Self {
        let whole = |at: Timestamp| at.0 % Timestamp::NANOS == 0;
        let mut stamps = tape.quotes().times().iter().copied().chain(tape.prints().iter().map(|print| print.time));
        let cut = orders.len() >= ENOUGH
            && stamps.any(|at| !whole(at))
            && !fills.is_empty()
            && orders.iter().all(|order| whole(order.decided_at))
            && fills.iter().all(|fill| whole(fill.filled_at));
        if !cut {
            return Self { orders: Cow::Borrowed(orders), fills: Cow::Borrowed(fills), early: 0 };
        }
        notes.push(
            "all stamps are whole seconds: they are taken for cut to a second, and for half a second later".to_owned(),
        );
        let early = Timestamp::NANOS / 2;
        let later = |at: Timestamp| Timestamp(at.0 + early);
        let orders = orders.iter().map(|order| LoggedOrder { decided_at: later(order.decided_at), ..order.clone() });
        let fills = fills.iter().map(|fill| LoggedFill { filled_at: later(fill.filled_at), ..fill.clone() });
        Self { orders: orders.collect(), fills: fills.collect(), early }
    }
}

/// So many standard errors of the usual delay are chance.
const CHANCE: f64 = 3.0;

/// `orders` whose stamps were cut, so that they are off by up to `rounding` [ns] either way: where the tape shows their own trades, the
/// usual delay before these, as far as the stamps allow. What an order does itself to the market would else pass for what its
/// decision was based on, and what the market does until the order is there for a delay.
///
/// A second has no preferred part to decide in: own trades are half a second after the stamps on average, and a delay later.
pub(super) fn before_own_trades<'a>(
    orders: &'a [LoggedOrder],
    fills: &[Vec<&LoggedFill>],
    tape: &Tape,
    rounding: i64,
) -> Cow<'a, [LoggedOrder]> {
    if rounding == 0 {
        return Cow::Borrowed(orders);
    }
    let own = |(order, fills): (&LoggedOrder, &Vec<&LoggedFill>)| {
        let pieces: Vec<Piece> = fills.iter().map(|f| Piece { quantity: f.quantity, price: f.price }).collect();
        let reported = Timestamp(fills.first()?.filled_at.0 + rounding);
        own_print(tape.prints(), order.side, Timestamp(order.decided_at.0 - rounding - 1), reported, &pieces)
    };
    let own: Vec<Option<Timestamp>> = orders.iter().zip(fills).map(own).collect();
    let late = orders.iter().zip(&own).filter_map(|(order, own)| Some((*own)?.0 - order.decided_at.0));
    let delay = usual_delay(late.collect(), rounding);
    let before = |(order, own): (&LoggedOrder, &Option<Timestamp>)| {
        let middle = order.decided_at.0;
        let within = |at: i64| at.clamp(middle - rounding, middle + rounding - 1);
        let decided = own.map_or(middle, |own| within(own.0 - delay - 1));
        LoggedOrder { decided_at: Timestamp(decided), ..order.clone() }
    };
    orders.iter().zip(&own).map(before).collect()
}

/// The usual delay [ns] of orders that traded so much [ns] `late`r than the middles of the stretches of `rounding` either way in which
/// they were decided; none where the middles alone may be as far off.
fn usual_delay(mut late: Vec<i64>, rounding: i64) -> i64 {
    late.sort_unstable();
    let Some(median) = late.get(late.len() / 2) else { return 0 };
    // That of the median of as many numbers which are evenly distributed over the stretch.
    let error = rounding as f64 / (late.len() as f64).sqrt();
    if *median as f64 > CHANCE * error { *median } else { 0 }
}

/// A fill of an order that rested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Made {
    /// What was filled, as of when it was reported.
    pub order: InFlight,
    /// At what price [currency].
    pub price: f64,
    /// What the order was charged; told with the first of its fills, and only where all of them rested.
    pub charged: Option<Charged>,
}

/// What an order was charged: some brokers say it with its first fill, others with each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Charged {
    /// What was filled of it in all [units].
    pub quantity: f64,
    /// What changed hands [currency].
    pub notional: f64,
    /// In all [currency].
    pub fee: f64,
}

impl Charged {
    fn of(fills: &[&LoggedFill]) -> Self {
        let sum = |value: &dyn Fn(&LoggedFill) -> f64| fills.iter().map(|fill| value(fill)).sum();
        Self { quantity: sum(&|f| f.quantity), notional: sum(&|f| f.quantity * f.price), fee: sum(&|f| f.fee) }
    }

    /// Average price [currency].
    pub fn price(&self) -> f64 {
        self.notional / self.quantity
    }
}

/// The fills of limit orders that rested, in order of time: those that were no better for the other side than what was displayed when
/// the order was decided took it.
pub(super) fn made(orders: &[LoggedOrder], fills: &[Vec<&LoggedFill>], tape: &Tape) -> Vec<Made> {
    let mut made: Vec<Made> = Vec::new();
    for (order, fills) in orders.iter().zip(fills) {
        if order.kind != OrderType::Other("limit".to_owned()) {
            continue;
        }
        let displayed =
            tape.book(Seen::at(order.decided_at)).and_then(|book| Some(book.opposite(order.side).first()?.price));
        let took = |fill: &LoggedFill| displayed.is_some_and(|price| order.side.sign() * (fill.price - price) >= 0.0);
        let mut charged = (!fills.iter().any(|fill| took(fill))).then(|| Charged::of(fills));
        for fill in fills.iter().filter(|fill| !took(fill)) {
            let Some(mid) = tape.mid(Seen::at(fill.filled_at)) else { continue };
            let filled = InFlight::market(order.side, fill.quantity, fill.filled_at, fill.price, mid).as_a(Role::Maker);
            made.push(Made { order: filled, price: fill.price, charged: charged.take() });
        }
    }
    made.sort_by_key(|made| made.order.decided_at);
    made
}

/// Rows of the market orders, in order of decision.
pub(super) fn market_orders(orders: &[LoggedOrder], made: &[Made], notes: &mut Vec<String>) -> Result<Vec<usize>, LogError> {
    let mut rows: Vec<usize> = (0..orders.len()).filter(|row| orders[*row].kind == OrderType::Market).collect();
    let others = orders.len() - rows.len();
    if rows.is_empty() && made.is_empty() {
        let kinds = orders.iter().find_map(|order| match &order.kind {
            OrderType::Other(kind) => Some(kind.as_str()),
            OrderType::Market => None,
        });
        return Err(LogError::of(
            LogTable::Orders,
            format!(
                "none of the {others} orders is a market order, or a limit order that rested and was filled; the first is \"{}\"",
                kinds.unwrap_or_default()
            ),
            "only these are modelled so far",
        ));
    }
    match (others, made.len()) {
        (0, _) => {}
        (_, 0) => notes.push(format!("{others} of {} orders are not market orders and are left out", orders.len())),
        (_, fills) => notes.push(format!(
            "{others} of {} orders are not market orders: of these, what {fills} fills of limit orders that rested were charged and \
             what the mid did after them is looked at, not whether and when they were filled",
            orders.len()
        )),
    }
    rows.sort_by_key(|row| orders[*row].decided_at);
    Ok(rows)
}

/// The orders of `rows` of whose decision the tape tells, as they were sent; there must be one, unless there are `others` to look at.
pub(super) fn on_tape(
    orders: &[LoggedOrder],
    rows: Vec<usize>,
    market: &LogMarket,
    others: bool,
    notes: &mut Vec<String>,
) -> Result<Vec<(usize, InFlight)>, LogError> {
    let Some((first, last)) = market.tape.span() else {
        return Err(LogError::of(
            LogTable::Orders,
            "there are neither quotes nor trades nor bars beside the orders",
            "name a tape under [market] in the twin, or put quotes, trades or bars into the folder",
        ));
    };
    // Silence after the last row of a tape is no stranger than silence within it.
    let last = last + market.tape.longest_silence();
    let (count, mut outside, mut unknown) = (rows.len(), Vec::new(), 0);
    let mut sent = Vec::with_capacity(count);
    for row in rows {
        let order = &orders[row];
        let (at, seen) = (order.decided_at, Seen::at(order.decided_at));
        if at < first || at > last {
            outside.push((row, if at < first { first.seconds_since(at) } else { at.seconds_since(last) }, at < first));
            continue;
        }
        let assumed = market.price.price(&market.tape, order.side, seen);
        match assumed.zip(market.tape.mid(seen)) {
            Some((assumed, mid)) => {
                let mut in_flight = InFlight::market(order.side, order.quantity, at, assumed, mid);
                in_flight.average_daily_volume = market.instrument.average_daily_volume;
                in_flight.daily_volatility = market.instrument.daily_volatility;
                in_flight.recent_volatility = recent::of_tape(&market.tape, at);
                sent.push((row, in_flight));
            }
            None => unknown += 1,
        }
    }
    let too_many = |part: usize| part as f64 > LEFT_OUT * count as f64;
    if let Some((row, seconds, before)) = outside.first().copied()
        && too_many(outside.len())
    {
        let (end, from) = if before { ("before the tape begins", first) } else { ("after the tape ends", last) };
        return Err(LogError {
            cell: Some((row, "decided_at")),
            found: Some(orders[row].decided_at.to_string()),
            ..LogError::of(
                LogTable::Orders,
                format!(
                    "{} of {count} orders are outside the tape; this one is decided {seconds:.3} s {end} ({from})",
                    outside.len()
                ),
                outside_hint(seconds),
            )
        });
    }
    if too_many(unknown) || sent.is_empty() && !others {
        return Err(LogError::of(
            LogTable::Orders,
            format!(
                "for {unknown} of {count} orders the tape does not know the price \"{}\" when they were decided",
                market.price
            ),
            "does the tape begin early enough, and has it both bid and ask?",
        ));
    }
    if outside.len() + unknown > 0 {
        notes.push(format!(
            "{} of {count} orders are left out: the tape does not know a price when they were decided",
            outside.len() + unknown
        ));
    }
    Ok(sent)
}

/// What may be behind orders that are `seconds` [s] off the tape.
fn outside_hint(seconds: f64) -> String {
    let hours = (seconds / 3600.0).round();
    if (1.0..=14.0).contains(&hours) {
        return format!("is one of the files in another zone, {hours} h or more away? Declare its `zone`");
    }
    if seconds > 365.25 * 86_400.0 {
        return "are times in another unit than nanoseconds? Declare `time_unit`".to_owned();
    }
    "do orders and tape come from the same days?".to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::market::{Print, Quotes, Side};

    const HALF: i64 = Timestamp::NANOS / 2;

    fn at(seconds: f64) -> Timestamp {
        Timestamp(1_000 * Timestamp::NANOS).plus_seconds(seconds)
    }

    /// When orders are taken to be decided, which bought so much at so many seconds, or are not on the tape, and whose stamps were cut.
    fn decided(bought: &[(f64, f64, bool)], rounding: i64) -> Vec<Timestamp> {
        let print = |(seconds, size, _): &(f64, f64, bool)| Print {
            time: at(*seconds),
            price: 50.0,
            size: *size,
            aggressor: Some(Side::Buy),
        };
        let prints = bought.iter().filter(|(.., shown)| *shown).map(print).collect();
        let tape = Tape::new(Quotes::with_depth(1), prints, Vec::new());
        let stamp = |seconds: f64| at(seconds.floor() + 0.5);
        let order = |(row, (seconds, quantity, _)): (usize, &(f64, f64, bool))| LoggedOrder {
            id: row.to_string(),
            side: Side::Buy,
            quantity: *quantity,
            decided_at: stamp(*seconds),
            kind: OrderType::Market,
            seen_mid: None,
        };
        let orders: Vec<LoggedOrder> = bought.iter().enumerate().map(order).collect();
        let fills: Vec<LoggedFill> = orders
            .iter()
            .map(|o| LoggedFill {
                order_id: o.id.clone(),
                filled_at: o.decided_at,
                quantity: o.quantity,
                price: 50.0,
                fee: 0.0,
            })
            .collect();
        let of_order: Vec<Vec<&LoggedFill>> = fills.iter().map(|fill| vec![fill]).collect();
        before_own_trades(&orders, &of_order, &tape, rounding).iter().map(|order| order.decided_at).collect()
    }

    #[test]
    fn an_order_whose_stamp_was_cut_was_decided_before_its_own_trade() {
        // One before the middle of the second, which stamps are taken for, one after it, and one that the tape does not show.
        let bought = [(0.2, 7.0, true), (0.8, 9.0, true), (0.9, 11.0, false)];
        assert_eq!(decided(&bought, HALF), [Timestamp(at(0.2).0 - 1), Timestamp(at(0.8).0 - 1), at(0.5)]);
        assert_eq!(decided(&bought, 0), [at(0.5); 3], "what was not cut is known");
    }

    #[test]
    fn orders_that_traded_late_on_average_took_their_time() {
        let seconds = |number: f64| number / 100.0 * Timestamp::NANOS as f64;
        let spread = |delay: f64| (0..100).map(|k| seconds(f64::from(k) - 49.5 + delay) as i64).collect::<Vec<_>>();
        assert_eq!(usual_delay(spread(2.0), HALF), 0, "as late may be chance");
        assert_eq!(usual_delay(spread(-30.0), HALF), 0, "none trades before it was decided");
        let usual = usual_delay(spread(40.0), HALF);
        assert!((usual - seconds(40.0) as i64).abs() <= seconds(1.0) as i64, "{usual}");
        assert_eq!(usual_delay(Vec::new(), HALF), 0);
    }
}
