//! A recorded log of orders beside the tape they met: what drives the execution plant.

use std::sync::Arc;

use crate::sim2real::{Measured, Recording, Timestamp};

use aspects::Aspect;

use super::log_clock::Clocked;
use super::log_entry::fills_of_orders;
use super::log_rows::{Made, Outcome, Stamps, before_own_trades, made, market_orders, on_tape};
use super::look::{Look, Traded, looks, market_came, shows_own};
use super::met_by_report::{met_at, met_by_report};
use super::quantum::quantum;
use super::queue_place::{Place, Places};
use super::reversal::{Came, discount};
use super::shown_age::{ShownAge, shown_age};
use super::{
    InFlight, Instrument, LogError, LogTable, LoggedFill, LoggedOrder, PriceAssumption, Role, Seen, ShownDelay, Tape,
    cost_bps, fee_bps, own_print,
};

mod aspects;
mod met;
mod scatter;

/// Where the orders of a log went, and what a backtest assumes of them.
#[derive(Debug, Clone)]
pub struct LogMarket {
    /// What was traded.
    pub instrument: Instrument,
    /// What the market showed.
    pub tape: Arc<Tape>,
    /// The price the twin assumes.
    pub price: PriceAssumption,
    /// Whether the market that was shown is one in which the orders of the log were; none where nobody says, and it is to be found
    /// out.
    pub shows_own_orders: Option<bool>,
}

/// The orders of a log, and what each would have met; in the aspect of the mid, looks at the market between them.
#[derive(Debug, Clone)]
pub struct OrderLog {
    market: LogMarket,
    orders: Vec<InFlight>,
    rows: Vec<Row>,
    /// What was filled of each order [units].
    executed: Vec<f64>,
    /// At what price [currency], where anything was.
    paid: Vec<Option<f64>>,
    /// Fills of orders that rested, in order of time.
    made: Vec<Made>,
    /// Looks at the market, where it shows the orders.
    looks: Vec<Look>,
    /// Places of orders that rested in their queues, where they were further back than what was displayed.
    places: Vec<Place>,
    /// What of the log is looked at.
    aspect: Aspect,
    shows_own_orders: bool,
    own_prints: Vec<Option<Timestamp>>,
    /// When each order met the market at the latest, where print or report tell.
    met_at: Vec<Option<Timestamp>>,
    /// Number of quotes that were known when each order was decided; none where there are too many.
    known: Vec<u32>,
    shown_delay: Option<ShownDelay>,
    shown_age: Option<f64>,
    /// What costs scatter by of themselves [bps], where prices are told finer than in ticks.
    cost_scatter: Option<f64>,
    /// Whether its stamps were cut, so that what the market did within a second of a decision may have come before it.
    cut: bool,
    notes: Vec<String>,
}

/// What a row of the recording is of.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Row {
    /// An order, by its number.
    Order(usize),
    /// A fill of an order that rested, by its number.
    Made(usize),
    /// The place of an order that rested, by its number.
    Queued(usize),
    /// A look at the mid.
    Look(Look),
}

impl OrderLog {
    /// The recording of a log: a row a market order, in order of decision, with the channels of [`Execution`](super::Execution). Where the tape shows
    /// what the orders did, one of its [`aspects`](Self::aspects) has rows between them for looks at the mid.
    ///
    /// `cost` is lost (`None`) where nothing was filled; it and `filled` are where the order was larger than all that was displayed:
    /// how it went on behind the last level is not in the data. `fee` is lost where nothing was filled. `seen` is there where orders
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
        // What no log can hold is said with the stamps that stand in it.
        fills_of_orders(orders, fills)?;
        let mut notes = market.tape.notes().to_vec();
        let Stamps { orders, fills, early } = Stamps::of(orders, fills, &market.tape, &mut notes);
        let cut = early > 0;
        let (orders, fills) = (orders.as_ref(), fills.as_ref());
        let of_order = fills_of_orders(orders, fills)?;
        let Clocked { orders, fills } = Clocked::of(orders, fills, &of_order, &market.tape, early, &mut notes);
        let (orders, fills) = (orders.as_ref(), fills.as_ref());
        let of_order = fills_of_orders(orders, fills)?;
        let orders = &*before_own_trades(orders, &of_order, &market.tape, early);
        let own: Vec<Timestamp> = fills.iter().map(|fill| fill.filled_at).collect();
        let mut made = made(orders, &of_order, &market.tape);
        let places = Places::of(orders, &of_order, &market.tape, early);
        notes.extend(places.note());
        let rows = market_orders(orders, &made, &mut notes)?;
        let rows = on_tape(orders, rows, &market, !made.is_empty(), &mut notes)?;
        let in_flight: Vec<InFlight> = rows.iter().map(|(_, order)| *order).collect();
        let executions: Vec<Outcome> = rows.iter().map(|(row, order)| Outcome::of(order, &of_order[*row])).collect();
        let own_prints: Vec<Option<Timestamp>> = in_flight
            .iter()
            .zip(&executions)
            .map(|(o, e)| {
                let reported = Timestamp(e.first_fill?.0 + early);
                own_print(market.tape.prints(), o.side, o.decided_at, reported, &e.pieces)
            })
            .collect();
        let tick_size = market.instrument.tick_size;
        let told = || met_by_report(&market.tape, market.price, tick_size, &in_flight, &executions).filter(|_| !cut);
        let met_at = met_at(&own_prints, told, &mut notes);
        let delays = in_flight.iter().zip(&met_at).filter_map(|(o, met)| Some(met.as_ref()?.seconds_since(o.decided_at)));
        let shown_delay = ShownDelay::of(delays.collect());
        let fills = executions.iter().zip(&own_prints);
        let traded: Vec<Traded> = fills.map(|(execution, print)| Traded::of(*print, execution.first_fill)).collect();
        let early = |at: Timestamp| Timestamp(at.0 - early);
        let traded: Vec<(Timestamp, Traded)> = in_flight
            .iter()
            .zip(traded)
            .map(|(order, traded)| (early(order.decided_at), traded.reported_at(early)))
            .collect();
        let found_out = || shows_own(&market.tape, &in_flight, &traded, tick_size);
        let shows_own_orders = market.shows_own_orders.unwrap_or_else(found_out);
        let taken = traded.iter().copied();
        let (mut rested, mut brought) = (Vec::with_capacity(made.len()), Vec::new());
        for made in &mut made {
            let reported = early(made.order.decided_at);
            if let Some([at, came]) = market_came(&market.tape, made, reported) {
                brought.extend(Came::at(&market.tape, at));
                made.order.decided_at = came.max(made.order.decided_at);
                rested.push((came, Traded::Report(reported)));
            } else {
                rested.push((reported, Traded::Report(reported)));
            }
        }
        made.sort_by_key(|made| made.order.decided_at);
        // Fills of orders that rest follow from the market, whether or not it shows them.
        let mut looks = match (shows_own_orders, made.is_empty()) {
            (true, _) => looks(&market.tape, &taken.chain(rested).collect::<Vec<_>>(), tick_size),
            (false, false) => looks(&market.tape, &rested, tick_size),
            (false, true) => Vec::new(),
        };
        discount(&mut looks, &market.tape, brought, own);
        let mut log = Self {
            rows: (0..in_flight.len()).map(Row::Order).collect(),
            known: known(&market.tape, &in_flight),
            executed: executions.iter().map(|execution| execution.quantity).collect(),
            paid: executions.iter().map(|execution| execution.price).collect(),
            made,
            looks,
            places: places.told().to_vec(),
            aspect: Aspect::Orders,
            shows_own_orders,
            market,
            shown_delay,
            shown_age: None,
            cost_scatter: None,
            cut,
            own_prints,
            met_at,
            orders: in_flight,
            notes,
        };
        if shows_own_orders {
            log.notes.push("the tape shows what the orders of the log did to the market".to_owned());
        }
        let mut measured = log.measure(&executions);
        log.cost_scatter = log.scatter_of(&measured, &executions);
        let seen: Vec<Option<f64>> = rows.iter().map(|(row, _)| orders[*row].seen_mid).collect();
        measured.extend(log.look_at_seen(&seen));
        Ok(Recording { name: name.to_owned(), time: log.times(), stimulus: log, measured })
    }

    /// The recording of `orders` as they would be sent, in the order of their decisions, of which nothing is measured: what they
    /// would cost is for a rollout to say. Orders may rest, and positions may be held among them.
    #[must_use]
    pub fn planned(name: &str, market: LogMarket, mut orders: Vec<InFlight>) -> Recording<Self> {
        orders.sort_by_key(|order| order.decided_at);
        let lost = |(channel, unit): (&str, &str)| Measured {
            channel: channel.into(),
            unit: unit.into(),
            samples: vec![None; orders.len()],
        };
        let measured = [("cost", "bps"), ("fee", "bps"), ("filled", "")].map(lost).into();
        let own_prints = vec![None; orders.len()];
        let met_at = own_prints.clone();
        let rows = (0..orders.len()).map(Row::Order).collect();
        let shows_own_orders = market.shows_own_orders.unwrap_or(false);
        let log = Self {
            known: known(&market.tape, &orders),
            market,
            executed: orders.iter().map(|order| order.quantity).collect(),
            paid: vec![None; orders.len()],
            made: Vec::new(),
            aspect: Aspect::Orders,
            orders,
            rows,
            looks: Vec::new(),
            places: Vec::new(),
            shows_own_orders,
            own_prints,
            met_at,
            shown_delay: None,
            shown_age: None,
            cost_scatter: None,
            cut: false,
            notes: Vec::new(),
        };
        Recording { name: name.to_owned(), time: log.times(), stimulus: log, measured }
    }

    /// When each row is, from the first decision on [s].
    fn times(&self) -> Vec<f64> {
        let made = self.made.first().map(|made| &made.order);
        let queued = self.places.first().map(|place| &place.order);
        let firsts = self.orders.first().into_iter().chain(made).chain(queued);
        let first = firsts.map(|order| order.decided_at).min().unwrap_or_default();
        self.rows.iter().map(|row| self.at(row).seconds_since(first)).collect()
    }

    fn at(&self, row: &Row) -> Timestamp {
        match row {
            Row::Order(number) => self.orders[*number].decided_at,
            Row::Made(number) => self.made[*number].order.decided_at,
            Row::Queued(number) => self.places[*number].order.decided_at,
            Row::Look(look) => look.at,
        }
    }

    /// What is known of the channels, order by order; notes what is not.
    fn measure(&mut self, executions: &[Outcome]) -> Vec<Measured> {
        let exhausted: Vec<bool> = (0..self.orders.len()).map(|row| self.exhausts(row)).collect();
        let cost = self.orders.iter().zip(executions).zip(&exhausted).map(|((order, e), exhausted)| {
            e.price.filter(|_| !exhausted).map(|price| cost_bps(order.side, price, order.assumed, order.mid))
        });
        let cost = cost.collect();
        let fee = executions.iter().map(|e| fee_bps(e.fee, e.notional)).collect();
        let filled = self.orders.iter().zip(executions).zip(&exhausted);
        let filled = filled.map(|((o, e), exhausted)| (!exhausted).then(|| (e.quantity / o.quantity).min(1.0))).collect();
        let count = self.orders.len();
        let larger = exhausted.iter().filter(|e| **e).count();
        if larger > 0 {
            self.notes.push(format!(
                "{larger} of {count} orders are larger than all that was displayed when they arrived; \
                 what they cost and how much of them was filled is left out, since the book behind the last level is not in the data"
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
                    "what orders saw (`seen_bid`, `seen_ask`) is not what the tape showed at any one age: of {known} that were asked \
                     at the best {explained} saw it; nothing is made of it"
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
        let arrives_at = order.decided_at.plus_seconds(self.shown_delay.and_then(ShownDelay::constant).unwrap_or(0.0));
        Seen::by(&order.arriving(arrives_at), self.met_at[row])
    }

    /// The orders, in order of decision.
    #[must_use]
    pub fn orders(&self) -> &[InFlight] {
        &self.orders
    }

    /// The order that is in `row` of the recording; none where it is a look at the market.
    #[must_use]
    pub fn order_of(&self, row: usize) -> Option<usize> {
        match self.rows.get(row)? {
            Row::Order(number) => Some(*number),
            Row::Made(_) | Row::Queued(_) | Row::Look(_) => None,
        }
    }

    /// How many rows of the recording are.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// How many of them are looks at the market.
    #[must_use]
    pub fn looks(&self) -> usize {
        self.rows.iter().filter(|row| matches!(row, Row::Look(_))).count()
    }

    /// Whether the tape shows what the orders did to the market.
    #[must_use]
    pub fn shows_own_orders(&self) -> bool {
        self.shows_own_orders
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

    /// The time from decision to the orders' own prints, or to when their reports tell that they met the market, where the stamps show one.
    #[must_use]
    pub fn shown_delay(&self) -> Option<ShownDelay> {
        self.shown_delay
    }

    /// The largest number of lots of which all that was filled of an order is a multiple [units], where there is one.
    #[must_use]
    pub fn quantum(&self) -> Option<f64> {
        quantum(self.executed.iter().copied(), self.market.instrument.lot_size)
    }

    /// The age of what orders were decided on [s], where the log shows one.
    #[must_use]
    pub fn shown_age(&self) -> Option<f64> {
        self.shown_age
    }

    /// Whether any of the orders meets the market as a `role`.
    #[must_use]
    pub fn has_a(&self, role: Role) -> bool {
        self.orders.iter().any(|order| order.role == role) || role == Role::Maker && self.rests()
    }

    /// Whether a row is of an order that rested.
    fn rests(&self) -> bool {
        self.rows.iter().any(|row| matches!(row, Row::Made(_) | Row::Queued(_)))
    }

    /// Whether the tape knows the volume an order meets.
    #[must_use]
    pub fn knows_volume(&self) -> bool {
        let first = self.orders.first();
        first.is_some_and(|order| self.tape().volume(order.side, Seen::at(order.decided_at)).is_finite())
    }

    /// Adds what a reader of results should know.
    #[must_use]
    pub fn with_note(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// What a reader of results should know: what was left out, and why.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }
}

/// How many quotes of the tape were known when each order was decided: the same in every run of the log. None where there are too many.
fn known(tape: &Tape, orders: &[InFlight]) -> Vec<u32> {
    let known: Result<_, _> = orders.iter().map(|order| u32::try_from(tape.known(order.decided_at))).collect();
    known.unwrap_or_default()
}

/// How far `price` is above `mid` [bps of it].
fn above(price: f64, mid: f64) -> f64 {
    (price - mid) / mid * 1e4
}
