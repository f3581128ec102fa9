//! A recorded log of orders beside the tape they met: what drives the execution plant.

use std::sync::Arc;

use crate::sim2real::{Measured, Recording, Stimulus, Timestamp};

use super::log_entry::fills_of_orders;
use super::shown_age::{ShownAge, shown_age};
use super::{
    Book, Execution, InFlight, Instrument, LogError, LogTable, LoggedFill, LoggedOrder, Met, OrderType, Piece,
    PriceAssumption, Role, Seen, Tape, cost_bps, fee_bps, own_print, shown_delay,
};

/// Where the orders of a log went, and what a backtest assumes of them.
#[derive(Debug, Clone)]
pub struct LogMarket {
    /// What was traded.
    pub instrument: Instrument,
    /// What the market showed.
    pub tape: Arc<Tape>,
    /// The price the twin assumes.
    pub price: PriceAssumption,
}

/// The orders of a log, and what each would have met.
#[derive(Debug, Clone)]
pub struct OrderLog {
    market: LogMarket,
    orders: Vec<InFlight>,
    own_prints: Vec<Option<Timestamp>>,
    shown_delay: Option<f64>,
    shown_age: Option<f64>,
    notes: Vec<String>,
}

/// The largest part of a log that may be left out because the tape does not tell of it.
const LEFT_OUT: f64 = 0.01;

impl OrderLog {
    /// The recording of a log: a row a market order, in order of decision, with the channels of [`Execution`].
    ///
    /// `cost` is lost (`None`) where nothing was filled, and where the order was larger than all that was displayed: how
    /// it went on behind the last level is not in the data. `fee` is lost where nothing was filled. `seen` is there where orders
    /// say what they saw, and that is what the tape showed at one age before their decisions.
    ///
    /// # Errors
    /// Rows no log can hold ([`LogError`]); a tape that lacks what the assumed price is made of; orders outside the
    /// tape, if there are more than one in a hundred; no market orders.
    pub fn recording(
        name: &str,
        market: LogMarket,
        orders: &[LoggedOrder],
        fills: &[LoggedFill],
    ) -> Result<Recording<Self>, LogError> {
        if let Some(lacking) = market.price.lacks(&market.tape) {
            return Err(LogError::of(
                LogTable::Orders,
                format!("the twin assumes the price \"{}\", but there are no {lacking}", market.price),
                format!("name {lacking} under [market] in the twin, or put them beside the orders"),
            ));
        }
        let of_order = fills_of_orders(orders, fills)?;
        let mut notes = market.tape.notes().to_vec();
        let rows = market_orders(orders, &mut notes)?;
        let rows = on_tape(orders, rows, &market, &mut notes)?;
        let in_flight: Vec<InFlight> = rows.iter().map(|(_, order)| *order).collect();
        let executions: Vec<Outcome> = rows.iter().map(|(row, order)| Outcome::of(order, &of_order[*row])).collect();
        let own_prints: Vec<Option<Timestamp>> = in_flight
            .iter()
            .zip(&executions)
            .map(|(o, e)| own_print(market.tape.prints(), o.side, o.decided_at, e.first_fill?, &e.pieces))
            .collect();
        let delays = in_flight.iter().zip(&own_prints).filter_map(|(o, p)| Some(p.as_ref()?.seconds_since(o.decided_at)));
        let shown_delay = shown_delay(delays.collect());
        let mut log = Self { market, shown_delay, shown_age: None, own_prints, orders: in_flight, notes };
        let first = log.orders[0].decided_at;
        let time = log.orders.iter().map(|order| order.decided_at.seconds_since(first)).collect();
        let mut measured = log.measure(&executions);
        let seen: Vec<Option<f64>> = rows.iter().map(|(row, _)| orders[*row].seen_mid).collect();
        measured.extend(log.look_at_seen(&seen));
        Ok(Recording { name: name.to_owned(), time, stimulus: log, measured })
    }

    /// The recording of `orders` as they would be sent, in the order of their decisions, of which nothing is measured: what they
    /// would cost is for a rollout to say. Orders may rest, and positions may be held among them.
    #[must_use]
    pub fn planned(name: &str, market: LogMarket, mut orders: Vec<InFlight>) -> Recording<Self> {
        orders.sort_by_key(|order| order.decided_at);
        let first = orders.first().map_or_else(Timestamp::default, |order| order.decided_at);
        let time = orders.iter().map(|order| order.decided_at.seconds_since(first)).collect();
        let lost = |(channel, unit): (&str, &str)| Measured {
            channel: channel.into(),
            unit: unit.into(),
            samples: vec![None; orders.len()],
        };
        let measured = [("cost", "bps"), ("fee", "bps"), ("filled", "")].map(lost).into();
        let own_prints = vec![None; orders.len()];
        let log = Self { market, orders, own_prints, shown_delay: None, shown_age: None, notes: Vec::new() };
        Recording { name: name.to_owned(), time, stimulus: log, measured }
    }

    /// What is known of the channels, order by order; notes what is not.
    fn measure(&mut self, executions: &[Outcome]) -> Vec<Measured> {
        let exhausted: Vec<bool> = (0..self.orders.len()).map(|row| self.exhausts(row)).collect();
        let cost = self.orders.iter().zip(executions).zip(&exhausted).map(|((order, e), exhausted)| {
            e.price.filter(|_| !exhausted).map(|price| cost_bps(order.side, price, order.assumed, order.mid))
        });
        let cost = cost.collect();
        let fee = executions.iter().map(|e| fee_bps(e.fee, e.notional)).collect();
        let filled = self.orders.iter().zip(executions).map(|(o, e)| Some((e.quantity / o.quantity).min(1.0))).collect();
        let count = self.orders.len();
        let larger = exhausted.iter().filter(|e| **e).count();
        if larger > 0 {
            self.notes.push(format!(
                "{larger} of {count} orders are larger than all that was displayed when they arrived; \
                 their cost is left out, since the book behind the last level is not in the data"
            ));
        }
        let unfilled = executions.iter().filter(|e| e.price.is_none()).count();
        if unfilled > 0 {
            self.notes.push(format!("{unfilled} of {count} orders were not filled at all; they have no cost"));
        }
        [("cost", "bps", cost), ("fee", "bps", fee), ("filled", "", filled)]
            .map(|(channel, unit, samples)| Measured { channel: channel.into(), unit: unit.into(), samples })
            .into()
    }

    /// The mids that were `seen` against those of the tape when orders were decided, where one age explains them: else they are
    /// of other things, which no law of the plant could say. Where they are what the tape shows, there is nothing to explain.
    fn look_at_seen(&mut self, seen: &[Option<f64>]) -> Option<Measured> {
        let known = self.orders.iter().zip(seen).filter_map(|(order, mid)| Some((order.decided_at, (*mid)?)));
        match shown_age(self.market.tape.quotes(), &known.collect::<Vec<_>>()) {
            ShownAge::Timely => None,
            ShownAge::Unclear { explained, known } => {
                self.notes.push(format!(
                    "what {known} orders saw (`seen_bid`, `seen_ask`) is not what the tape showed at any one age: at the best of \
                     {explained}; nothing is made of it"
                ));
                None
            }
            ShownAge::Aged(seconds) => {
                self.shown_age = Some(seconds);
                let samples =
                    self.orders.iter().zip(seen).map(|(order, mid)| mid.map(|mid| above(mid, order.mid))).collect();
                Some(Measured { channel: "seen".into(), unit: "bps".into(), samples })
            }
        }
    }

    /// Whether order `row` is larger than all that was displayed when it arrived, as far as the stamps tell when that was.
    fn exhausts(&self, row: usize) -> bool {
        let order = &self.orders[row];
        let book = self.market.tape.book(self.seen_on_arrival(row));
        book.and_then(|book| book.walk(order.side, order.quantity)).is_some_and(|walk| walk.exhausted)
    }

    /// What order `row` found where it arrived by the delay the stamps show; without one, what it was decided on.
    pub(super) fn seen_on_arrival(&self, row: usize) -> Seen {
        let order = self.orders[row];
        let arrives_at = order.decided_at.plus_seconds(self.shown_delay.unwrap_or(0.0));
        Seen::by(&order.arriving(arrives_at), self.own_prints[row])
    }

    /// The orders, in order of decision.
    #[must_use]
    pub fn orders(&self) -> &[InFlight] {
        &self.orders
    }

    /// The first print of each order's own trades, where it was found on the tape.
    #[must_use]
    pub fn own_prints(&self) -> &[Option<Timestamp>] {
        &self.own_prints
    }

    /// The tape.
    #[must_use]
    pub fn tape(&self) -> &Tape {
        &self.market.tape
    }

    /// The price the twin assumes.
    #[must_use]
    pub fn price(&self) -> PriceAssumption {
        self.market.price
    }

    /// What was traded.
    #[must_use]
    pub fn instrument(&self) -> &Instrument {
        &self.market.instrument
    }

    /// The time from decision to the orders' own prints [s], where the stamps show one.
    #[must_use]
    pub fn shown_delay(&self) -> Option<f64> {
        self.shown_delay
    }

    /// The age of what orders were decided on [s], where the log shows one.
    #[must_use]
    pub fn shown_age(&self) -> Option<f64> {
        self.shown_age
    }

    /// Whether any of the orders meets the market as a `role`.
    #[must_use]
    pub fn has_a(&self, role: Role) -> bool {
        self.orders.iter().any(|order| order.role == role)
    }

    /// Whether the tape knows the volume an order meets.
    #[must_use]
    pub fn knows_volume(&self) -> bool {
        let first = self.orders.first();
        first.is_some_and(|order| self.tape().volume(order.side, Seen::at(order.decided_at)).is_finite())
    }

    /// What a reader of results should know: what was left out, and why.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

impl Stimulus<Execution> for OrderLog {
    fn command(&self, row: usize) -> InFlight {
        self.orders[row]
    }

    fn input(&self, row: usize, arriving: &InFlight) -> Met {
        let seen = Seen::by(arriving, self.own_prints[row]);
        let tape = self.tape();
        let book = tape.book(seen);
        // Where the tape has ended or shows one side only, the assumption stays as it was at the decision.
        let price = self.market.price.price_beside(book.as_ref(), tape, arriving.side, seen);
        let reference = price.unwrap_or(arriving.assumed);
        let volume = tape.volume_beside(book.as_ref(), arriving.side, seen);
        let book = book.unwrap_or_else(|| Book::at_price(seen.end(), reference));
        // What rests joins the best price of its own side.
        let joined = book.opposite(arriving.side.opposite()).first().filter(|_| arriving.role == Role::Maker);
        let displayed = joined.map_or(0.0, |level| level.size);
        Met { displayed, seen: self.moved_since_seen(arriving), ..Met::at(book, reference, volume) }
    }
}

impl OrderLog {
    /// The mid that had been seen when `order` was decided, above what the mid was then [bps].
    fn moved_since_seen(&self, order: &InFlight) -> f64 {
        // A log that does not say what was seen is not asked: looking up costs time.
        if self.shown_age.is_none() || order.seen_until == order.decided_at {
            return 0.0;
        }
        self.tape().mid(Seen::at(order.seen_until)).map_or(0.0, |mid| above(mid, order.mid))
    }
}

/// How far `price` is above `mid` [bps of it].
fn above(price: f64, mid: f64) -> f64 {
    (price - mid) / mid * 1e4
}

/// What became of one order.
struct Outcome {
    pieces: Vec<Piece>,
    first_fill: Option<Timestamp>,
    quantity: f64,
    notional: f64,
    fee: f64,
    /// Average price, where anything was filled.
    price: Option<f64>,
}

impl Outcome {
    fn of(order: &InFlight, fills: &[&LoggedFill]) -> Self {
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

/// Rows of the market orders, in order of decision.
fn market_orders(orders: &[LoggedOrder], notes: &mut Vec<String>) -> Result<Vec<usize>, LogError> {
    let mut rows: Vec<usize> = (0..orders.len()).filter(|row| orders[*row].kind == OrderType::Market).collect();
    let others = orders.len() - rows.len();
    if rows.is_empty() {
        let kinds = orders.iter().find_map(|order| match &order.kind {
            OrderType::Other(kind) => Some(kind.as_str()),
            OrderType::Market => None,
        });
        return Err(LogError::of(
            LogTable::Orders,
            format!("none of the {others} orders is a market order; the first is \"{}\"", kinds.unwrap_or_default()),
            "only market orders are modelled so far",
        ));
    }
    if others > 0 {
        notes.push(format!("{others} of {} orders are not market orders and are left out", orders.len()));
    }
    rows.sort_by_key(|row| orders[*row].decided_at);
    Ok(rows)
}

/// The orders of `rows` of whose decision the tape tells, as they were sent.
fn on_tape(
    orders: &[LoggedOrder],
    rows: Vec<usize>,
    market: &LogMarket,
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
    if too_many(unknown) || sent.is_empty() {
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
