//! A backtest under way: feed, strategy, venue and ledger, one event at a time.

use std::collections::BTreeMap;
use std::fmt;

use crate::sim2real::Timestamp;

use super::account::Keeping;
use super::agenda::{Agenda, Due, Phase};
use super::backtest::{Backtest, BacktestError, EquityPoint, Held, Record, Settings};
use super::blotter::Blotter;
use super::carry::Carry;
use super::known::Known;
use super::latency::Clocks;
use super::mail::Mail;
use super::transit::Transit;
use super::venue::{Detail, Outcome, Resting, Rules, Setup, Venue};
use super::{
    Arrival, Cash, Daily, DepthBook, Event, EventKind, Feed, History, Ledger, MoneyError, OrderId, Orders, Price, Reference,
    Strategy, View,
};

/// A backtest under way.
pub struct Session<'d> {
    pub(super) setup: &'d Backtest,
    pub(super) feed: Feed<'d>,
    transit: Transit,
    /// Data take no time to the strategy but what their own two times say.
    direct: bool,
    pub(super) agenda: Agenda,
    pub(super) clocks: Clocks,
    pub(super) known: Vec<Known>,
    pub(super) daily: Vec<Daily>,
    pub(super) venue: Venue,
    /// What kind of data the orders of each instrument meet.
    pub(super) data_of: Vec<EventKind>,
    /// Orders on their way to the venue.
    pub(super) sent: BTreeMap<OrderId, (usize, Resting)>,
    /// What became of orders and is not known yet.
    pub(super) mail: Mail,
    pub(super) outcomes: Vec<Outcome>,
    pub(super) terms: Vec<f64>,
    /// The bar of each instrument whose open is on the agenda.
    expected: Vec<Option<usize>>,
    pub(super) ledger: Ledger,
    pub(super) carry: Carry,
    pub(super) orders: Orders,
    pub(super) blotter: Blotter,
    equity: Vec<EquityPoint>,
    held: Held,
    rows: usize,
    /// Terms, rates and corporate actions, where the account has any.
    pub(super) keeping: Option<Box<Keeping>>,
}

impl fmt::Debug for Session<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").field("events", &self.held.events).finish_non_exhaustive()
    }
}

/// How finely a history knows its market.
fn detail(history: &History) -> Detail {
    if !history.order_events().is_empty() {
        Detail::ByOrder
    } else if !history.depth().is_empty() {
        Detail::ByPrice
    } else if !history.quotes().is_empty() || !history.prints().is_empty() {
        Detail::Quotes
    } else {
        Detail::Bars
    }
}

impl<'d> Session<'d> {
    pub(super) fn new(setup: &'d Backtest) -> Self {
        let feed = Feed::new(&setup.histories);
        let Settings { seed, reference, matching, latencies, .. } = setup.settings.clone();
        let reference = reference.unwrap_or_else(|| Reference::suiting(&setup.venue));
        let origin = feed.peek().unwrap_or_default();
        let (intrabar, limit_fill, queue) = (matching.intrabar, matching.limit_fill, matching.queue);
        let depth: Vec<Detail> = setup.histories.iter().map(detail).collect();
        let known = |(k, detail): (usize, &Detail)| Known {
            book: matches!(detail, Detail::ByPrice | Detail::ByOrder).then(|| DepthBook::new(setup.increments[k])),
            ..Known::default()
        };
        let known = depth.iter().enumerate().map(known).collect();
        let data_of = setup.histories.iter().zip(&depth).map(|(history, detail)| match detail {
            Detail::Bars => EventKind::Bar,
            Detail::Quotes if history.quotes().is_empty() => EventKind::Trade,
            Detail::Quotes => EventKind::Quote,
            Detail::ByPrice | Detail::ByOrder => EventKind::Depth,
        });
        let data_of = data_of.collect();
        let venue = Setup {
            symbols: setup.instruments.iter().map(|i| i.symbol.as_str()).collect(),
            increments: &setup.increments,
            depth,
            rules: Rules { reference, intrabar, limit_fill, queue, origin },
            seed,
        };
        let venue = Venue::new(&setup.venue, &venue);
        let conceding = venue.conceding.len();
        let count = setup.instruments.len();
        let mut agenda = Agenda::default();
        let (ledger, keeping) = Keeping::start(&setup.settings, count, origin, &mut agenda);
        Self {
            setup,
            equity: Vec::with_capacity(feed.events() + 1),
            feed,
            transit: Transit::new(count),
            agenda,
            direct: latencies.feed.is_none(),
            clocks: Clocks::new(latencies, seed),
            known,
            daily: vec![Daily::default(); count],
            blotter: Blotter { conceding: venue.conceding.clone(), ..Blotter::default() },
            venue,
            data_of,
            sent: BTreeMap::new(),
            mail: Mail::new(conceding),
            outcomes: Vec::new(),
            terms: Vec::new(),
            expected: vec![None; count],
            ledger,
            keeping: keeping.map(Box::new),
            carry: Carry::new(count),
            orders: Orders::default(),
            held: Held::default(),
            rows: 0,
        }
    }

    /// Rows of data read, and rows in all.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        (self.rows, self.feed.events())
    }

    /// Lets the next event happen that the strategy sees, after all that happens before it; none when the data have ended.
    ///
    /// What becomes of orders at the very time of an event is not seen by it: what is decided at an instant rests on the data of
    /// that instant, not on what becomes of orders at it.
    ///
    /// # Errors
    /// As [`Backtest::run`].
    pub fn step(&mut self, strategy: &mut dyn Strategy) -> Result<Option<Event>, BacktestError> {
        loop {
            let (data, shown) = (self.feed.peek(), self.transit.peek());
            let next = match (data, shown) {
                (Some(data), Some(shown)) => data.min(shown),
                (Some(next), None) | (None, Some(next)) => next,
                (None, None) => return Ok(None),
            };
            if self.agenda.peek().is_some_and(|due| due < (next, Phase::Data) && !self.a_bar_ends_first(due)) {
                if let Some(event) = self.act(Some(strategy))? {
                    return Ok(Some(event));
                }
                continue;
            }
            if data == Some(next) {
                let Some(arrival) = self.feed.next() else { return Ok(None) };
                self.rows += arrival.end - arrival.row;
                self.happen(&arrival)?;
                if self.direct && arrival.known_at <= next {
                    return self.show(&arrival, strategy).map(Some);
                }
                self.transit.put(self.clocks.shown(arrival.known_at), arrival);
            } else if let Some((at, arrival)) = self.transit.pop() {
                let arrival = Arrival { event: Event { time: at, ..arrival.event }, ..arrival };
                return self.show(&arrival, strategy).map(Some);
            }
        }
    }

    /// Ends it: what is due by the last event happens, what is under way is booked, and what met no market stays unfilled.
    ///
    /// # Errors
    /// As [`Backtest::run`].
    pub fn finish(mut self) -> Result<Record, BacktestError> {
        let end = self.equity.last().map_or(Timestamp::MIN, |point| point.time);
        let fills = self.blotter.fills.len();
        let before = self.ledger.balances().to_vec();
        while self.agenda.peek().is_some_and(|(at, _)| at <= end) || !self.mail.is_empty() {
            let Some((at, due)) = self.agenda.pop() else { break };
            match due {
                Due::Notice(place) => drop(self.note(place)?),
                due if at <= end => self.at_venue(at, due)?,
                _ => {}
            }
        }
        self.charge_all(end)?;
        if self.blotter.fills.len() > fills || self.ledger.balances() != before {
            let equity = self.ledger.equity().map_err(|error| self.amount("the end".into(), error))?;
            self.equity.push(EquityPoint { time: end, equity: equity.to_f64() });
        }
        self.held.ambiguous_bars = self.venue.floors.iter().map(|floor| floor.ambiguous_bars()).sum();
        let account = self.keeping.map(|keeping| keeping.record).unwrap_or_default();
        Ok(Record { blotter: self.blotter, equity: self.equity, ledger: self.ledger, held: self.held, account })
    }

    /// What is due next happens: the event it makes for the strategy, if it asked to be woken.
    fn act(&mut self, strategy: Option<&mut dyn Strategy>) -> Result<Option<Event>, BacktestError> {
        let Some((at, due)) = self.agenda.pop() else { return Ok(None) };
        if self.keeping.is_some() {
            self.look_up_rates(at);
        }
        match due {
            Due::Notice(place) => self.deliver(place, at, strategy).map(|()| None),
            Due::Action(number) => self.take_action(number, at, strategy).map(|()| None),
            Due::Wake => {
                let event = Event { time: at, instrument: 0, kind: EventKind::Timer };
                match strategy {
                    Some(strategy) => self.decide(event, strategy).map(Some),
                    None => Ok(None),
                }
            }
            due => self.at_venue(at, due).map(|()| None),
        }
    }

    /// Something happens at the exchange: orders that wait there meet it.
    #[inline(always)]
    fn happen(&mut self, arrival: &Arrival) -> Result<(), BacktestError> {
        let Event { time, instrument, kind } = arrival.event;
        let history = &self.setup.histories[instrument];
        let floor = &mut self.venue.floors[instrument];
        match kind {
            EventKind::Bar => {
                if floor.by_bars() && !floor.is_idle() {
                    let bars = history.bars();
                    let bar = &bars[arrival.row];
                    floor.at_row(0, arrival.row);
                    floor.on_bar(bar, ends_day(bars.get(arrival.row + 1).map(|next| next.open_at), bar.open_at));
                    self.expect_open(instrument);
                }
            }
            EventKind::Quote => {
                floor.at_row(1, arrival.row);
                if let Some(quote) = history.quotes().all().get(arrival.row) {
                    floor.on_quote(&quote, time);
                }
            }
            EventKind::Trade => {
                floor.at_row(2, arrival.row);
                floor.on_print(&history.prints()[arrival.row], time);
            }
            EventKind::Depth => {
                floor.at_row(3, arrival.row);
                if history.order_events().is_empty() {
                    history.depth()[arrival.row..arrival.end].iter().for_each(|change| floor.on_depth(change));
                } else {
                    history.order_events()[arrival.row..arrival.end].iter().for_each(|event| floor.on_order(event));
                }
                floor.look(time);
            }
            EventKind::Timer => {}
        }
        if self.venue.floors[instrument].is_quiet() { Ok(()) } else { self.settle(instrument) }
    }

    /// Puts the open of the next bar on the agenda, where an order waits for it.
    pub(super) fn expect_open(&mut self, instrument: usize) {
        let floor = &self.venue.floors[instrument];
        if !floor.by_bars() || floor.is_idle() {
            return;
        }
        let Some(row) = self.feed.next_bar(instrument).filter(|row| self.expected[instrument] != Some(*row)) else { return };
        let Some(bar) = self.setup.histories[instrument].bars().get(row) else { return };
        if floor.awaits_open(bar.open_at) {
            self.expected[instrument] = Some(row);
            self.agenda.put(bar.open_at, Phase::Opens, Due::Open(instrument));
        }
    }

    /// The next bar of an instrument opens.
    pub(super) fn open_bar(&mut self, instrument: usize) {
        let Some(row) = self.expected[instrument] else { return };
        let bars = self.setup.histories[instrument].bars();
        let first = ends_day(Some(bars[row].open_at), row.checked_sub(1).map_or(Timestamp::MIN, |k| bars[k].open_at));
        let floor = &mut self.venue.floors[instrument];
        floor.at_row(0, row);
        floor.on_open(&bars[row], first);
    }

    /// Shows the strategy what became known, and sends what it asks for.
    #[inline(always)]
    fn show(&mut self, arrival: &Arrival, strategy: &mut dyn Strategy) -> Result<Event, BacktestError> {
        let event = arrival.event;
        self.carry_over(event.time)?;
        self.learn(arrival, strategy.lookback().max(1)).map_err(|error| self.money(event, error))?;
        if self.keeping.is_some() {
            self.keep_account(arrival)?;
        }
        self.decide(event, strategy)
    }

    #[inline(always)]
    fn decide(&mut self, event: Event, strategy: &mut dyn Strategy) -> Result<Event, BacktestError> {
        let equity = self.ledger.equity().map_err(|error| self.money(event, error))?;
        self.account(event.time, equity);
        let (view, orders) = self.view(event, equity);
        strategy.on_event(&view, orders);
        self.send_asked(event.time, equity);
        Ok(event)
    }

    #[inline(always)]
    pub(super) fn view(&mut self, event: Event, equity: Cash) -> (View<'_>, &mut Orders) {
        let view = View {
            event,
            known: &self.known,
            instruments: &self.setup.instruments,
            increments: &self.setup.increments,
            ledger: &self.ledger,
            equity,
        };
        (view, &mut self.orders)
    }

    #[inline(always)]
    pub(super) fn send_asked(&mut self, now: Timestamp, equity: Cash) {
        if !self.orders.requests().is_empty() {
            self.send_all(now, equity);
        }
    }

    /// Takes in what became known, and values what is held by it.
    #[inline(always)]
    fn learn(&mut self, arrival: &Arrival, keep: usize) -> Result<(), MoneyError> {
        let Event { time, instrument, kind } = arrival.event;
        let (history, known) = (&self.setup.histories[instrument], &mut self.known[instrument]);
        known.keep = keep;
        let (price, volume) = match kind {
            EventKind::Bar => {
                let bar = history.bars()[arrival.row];
                known.bars.push(bar, keep);
                (Some(bar.close), bar.volume)
            }
            EventKind::Quote => {
                known.quotes.push(history.quotes(), arrival.row, keep);
                // A quote with an empty side has no mid; the last one stands.
                let mid = known.quotes.newest(1).last().and_then(|quote| quote.mid());
                (mid.map(Price::nearest).transpose()?, 0.0)
            }
            EventKind::Trade => {
                let print = history.prints()[arrival.row];
                known.prints.push(print, keep);
                let alone = history.quotes().is_empty() && known.book.is_none() && history.bars().is_empty();
                (if alone { Some(Price::nearest(print.price)?) } else { None }, print.size)
            }
            EventKind::Depth => (known.learn_depth(history, arrival), 0.0),
            EventKind::Timer => (None, 0.0),
        };
        let Some(price) = price else { return Ok(()) };
        known.mark = Some(price);
        self.daily[instrument].see(time, price, volume);
        if self.clocks.watches() {
            self.clocks.watch(time, price.to_f64());
        }
        self.ledger.mark(instrument, price)
    }

    #[inline(always)]
    fn account(&mut self, time: Timestamp, equity: Cash) {
        let equity = equity.to_f64();
        self.held.events += 1;
        if !self.ledger.is_flat() {
            self.held.invested += 1;
            if equity > 0.0 {
                self.held.leverage += self.ledger.gross() / equity;
            }
        }
        self.equity.push(EquityPoint { time, equity });
    }
}

/// Whether `next`, if anything, comes on another day of UTC than `this`.
fn ends_day(next: Option<Timestamp>, this: Timestamp) -> bool {
    const DAY: i64 = 86_400 * Timestamp::NANOS;
    next.is_none_or(|next| next.0.div_euclid(DAY) != this.0.div_euclid(DAY))
}
