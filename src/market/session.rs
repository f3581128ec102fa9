//! A backtest under way: feed, strategy, venue and ledger, one event at a time.

use std::fmt;

use crate::sim2real::Timestamp;

use super::backtest::{Backtest, BacktestError, EquityPoint, Held, Record, Settings};
use super::blotter::{Blotter, Fill, FillCost, Order, Reason, Rejection, Status};
use super::strategy::Window;
use super::{
    Answer, Cash, Daily, Event, EventKind, Feed, InFlight, Increments, Ledger, MoneyError, Orders, Price, Quantity,
    Reference, Request, Strategy, Trade, Venue, View,
};

/// A backtest under way.
pub struct Session<'d> {
    setup: &'d Backtest,
    /// Prices of fills move in these: ticks, unless a mechanism averages over several trades.
    fill_increments: Vec<Increments>,
    feed: Feed<'d>,
    windows: Vec<Window<'d>>,
    daily: Vec<Daily>,
    venue: Venue<'d>,
    ledger: Ledger,
    orders: Orders,
    blotter: Blotter,
    equity: Vec<EquityPoint>,
    held: Held,
}

impl fmt::Debug for Session<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Session").field("events", &self.held.events).finish_non_exhaustive()
    }
}

impl<'d> Session<'d> {
    pub(super) fn new(setup: &'d Backtest) -> Self {
        let feed = Feed::new(&setup.histories);
        let Settings { cash, seed, reference, .. } = setup.settings;
        let symbols: Vec<&str> = setup.instruments.iter().map(|i| i.symbol.as_str()).collect();
        let reference = reference.unwrap_or_else(|| Reference::suiting(&setup.venue));
        let origin = feed.peek().unwrap_or_default();
        let venue = Venue::new(&setup.venue, reference, &setup.histories, &symbols, origin, seed);
        let averages = venue.averages();
        let count = setup.instruments.len();
        Self {
            setup,
            fill_increments: setup.increments.iter().map(|i| if averages { i.without_tick() } else { *i }).collect(),
            equity: Vec::with_capacity(feed.events() + 1),
            feed,
            windows: vec![Window::default(); count],
            daily: vec![Daily::default(); count],
            venue,
            ledger: Ledger::new(cash, count),
            orders: Orders::default(),
            blotter: Blotter::default(),
            held: Held::default(),
        }
    }

    /// Events seen, and events in all.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        (self.held.events, self.feed.events())
    }

    /// Lets the next event happen, after all fills before it; none when the data have ended.
    ///
    /// A fill at the very time of an event is not seen by it: what is decided at an instant rests on the data of that
    /// instant, not on what becomes of orders at it.
    ///
    /// # Errors
    /// As [`Backtest::run`].
    pub fn step(&mut self, strategy: &mut dyn Strategy) -> Result<Option<Event>, BacktestError> {
        let Some(now) = self.feed.peek() else { return Ok(None) };
        while self.venue.next_due().is_some_and(|due| due < now) {
            self.fill_next()?;
        }
        let Some((event, row)) = self.feed.next() else { return Ok(None) };
        self.show(event, row, strategy.lookback().max(1)).map_err(|error| self.money(event, error))?;
        let equity = self.ledger.equity().map_err(|error| self.money(event, error))?;
        self.account(event.time, equity);
        let view = View {
            event,
            windows: &self.windows,
            instruments: &self.setup.instruments,
            increments: &self.setup.increments,
            ledger: &self.ledger,
            equity,
        };
        strategy.on_event(&view, &mut self.orders);
        if !self.orders.requests().is_empty() {
            self.send_all(event.time, equity)?;
        }
        Ok(Some(event))
    }

    /// Ends it: fills what met the market by the last event, and leaves what did not as unfilled.
    ///
    /// # Errors
    /// As [`Backtest::run`].
    pub fn finish(mut self) -> Result<Record, BacktestError> {
        let end = self.equity.last().map_or(Timestamp::MIN, |point| point.time);
        let fills = self.blotter.fills.len();
        while self.venue.next_due().is_some_and(|due| due <= end) {
            self.fill_next()?;
        }
        if self.blotter.fills.len() > fills {
            let equity = self.ledger.equity().map_err(|error| BacktestError::Money { place: "the end".into(), error })?;
            self.equity.push(EquityPoint { time: end, equity: equity.to_f64() });
        }
        Ok(Record { blotter: self.blotter, equity: self.equity, ledger: self.ledger, held: self.held })
    }

    /// Moves the window of an instrument to include the row that became known, and values what is held of it.
    #[inline]
    fn show(&mut self, event: Event, row: usize, lookback: usize) -> Result<(), MoneyError> {
        let (history, window) = (&self.setup.histories[event.instrument], &mut self.windows[event.instrument]);
        let start = (row + 1).saturating_sub(lookback);
        let (price, volume) = match event.kind {
            EventKind::Bar => {
                window.bars = &history.bars()[start..=row];
                let bar = &history.bars()[row];
                (bar.close, bar.volume)
            }
            EventKind::Quote => {
                window.quotes = history.quotes().between(start, row + 1);
                // A quote with an empty side has no mid; the last one stands.
                match window.quotes.last().and_then(|quote| quote.mid()) {
                    Some(mid) => (Price::nearest(mid)?, 0.0),
                    None => return Ok(()),
                }
            }
        };
        window.mark = Some(price);
        self.daily[event.instrument].see(event.time, price, volume);
        self.ledger.mark(event.instrument, price)
    }

    #[inline]
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

    /// Sends what the strategy asked for, or refuses it.
    fn send_all(&mut self, now: Timestamp, equity: Cash) -> Result<(), BacktestError> {
        let mut orders = std::mem::take(&mut self.orders);
        for request in orders.requests() {
            match self.admit(request, equity.to_f64()) {
                Ok(price) => self.send(now, request, price),
                Err(reason) => {
                    let Request { instrument, side, quantity } = *request;
                    self.blotter.reject(Rejection { decided_at: now, instrument, side, quantity, reason });
                }
            }
        }
        orders.clear();
        self.orders = orders;
        Ok(())
    }

    /// The price at decision of an order that may be sent, or why it may not.
    fn admit(&self, request: &Request, equity: f64) -> Result<Price, Reason> {
        let increments = self.setup.increments.get(request.instrument).ok_or(Reason::UnknownInstrument)?;
        if request.quantity <= Quantity::ZERO {
            return Err(Reason::NoQuantity);
        }
        if !increments.holds(request.quantity) {
            return Err(Reason::OffLot);
        }
        let price = self.windows[request.instrument].mark.ok_or(Reason::NoPrice)?;
        let (mut before, mut after) = (0.0, 0.0);
        for (k, (position, window)) in self.ledger.positions().iter().zip(&self.windows).enumerate() {
            let coming = position.quantity + window.working;
            let mark = window.mark.unwrap_or_default();
            before += (mark * coming).to_f64().abs();
            let then = if k == request.instrument { coming + request.quantity.signed(request.side) } else { coming };
            after += (mark * then).to_f64().abs();
        }
        if after > before && after > self.setup.settings.max_leverage * equity { Err(Reason::Leverage) } else { Ok(price) }
    }

    fn send(&mut self, now: Timestamp, request: &Request, price: Price) {
        let Request { instrument, side, quantity } = *request;
        let order_id = self.blotter.orders.len() as u64 + 1;
        let (about, daily) = (&self.setup.instruments[instrument], &self.daily[instrument]);
        let mid = price.to_f64();
        let order = InFlight {
            side,
            role: super::Role::Taker,
            quantity: quantity.to_f64(),
            decided_at: now,
            arrives_at: now,
            assumed: self.venue.assumed(instrument, side, now).unwrap_or(mid),
            mid,
            participation_limit: f64::INFINITY,
            average_daily_volume: about.average_daily_volume.or_else(|| daily.volume()),
            daily_volatility: about.daily_volatility.or_else(|| daily.volatility()),
        };
        let window = &mut self.windows[instrument];
        let quote = window.quotes.last();
        // An order the data are too short for never leaves the way: it stays `working` and `Unfilled`.
        self.venue.send(order_id, instrument, &order);
        window.working = window.working + quantity.signed(side);
        self.blotter.orders.push(Order {
            order_id,
            instrument,
            decided_at: now,
            side,
            quantity,
            decision_price: price,
            seen_bid: quote.and_then(|quote| quote.bid()),
            seen_ask: quote.and_then(|quote| quote.ask()),
            status: Status::Unfilled,
            filled: Quantity::ZERO,
        });
    }

    /// Lets the next order meet the market, and books what was filled.
    fn fill_next(&mut self) -> Result<(), BacktestError> {
        let Some(answer) = self.venue.answer() else { return Ok(()) };
        let Answer { order_id, instrument, time, mid, report } = answer;
        let Some(order) = self.blotter.orders.get_mut(order_id as usize - 1) else { return Ok(()) };
        let symbol = &self.setup.instruments[instrument].symbol;
        let money = |error| BacktestError::Money { place: format!("order {order_id} for {symbol} at {time}"), error };
        let increments = self.fill_increments[instrument];
        let window = &mut self.windows[instrument];
        window.working = window.working - order.quantity.signed(order.side);
        let reported = Quantity::nearest(report.quantity).map_err(money)?;
        // A quantity beyond 2^53 steps does not come back from a float as it went in: what is filled whole is whole.
        let whole = report.filled >= 1.0 || reported >= order.quantity;
        let quantity = if whole { order.quantity } else { increments.whole_lots(reported) };
        order.status = if quantity == order.quantity { Status::Filled } else { Status::Cancelled };
        if quantity <= Quantity::ZERO {
            return Ok(());
        }
        if !report.price.is_finite() || report.price <= 0.0 {
            return Err(BacktestError::ModelPrice { order_id, symbol: symbol.clone(), time, price: report.price });
        }
        order.filled = quantity;
        let side = order.side;
        let price = increments.against(side, Price::nearest(report.price).map_err(money)?);
        if price.0 <= 0 {
            return Err(BacktestError::ModelPrice { order_id, symbol: symbol.clone(), time, price: report.price });
        }
        let fee = Cash::nearest(report.fee).map_err(money)?;
        let held = self.ledger.positions()[instrument].quantity;
        let closes = held.signed(side) < Quantity::ZERO;
        let realised = self.ledger.book(&Trade { instrument, side, price, quantity, fee }).map_err(money)?;
        let loss = |from: f64, to: f64| side.sign() * (to - from) * quantity.to_f64();
        let cost = FillCost {
            timing: loss(order.decision_price.to_f64(), mid),
            spread_and_impact: loss(mid, report.price),
            rounding: loss(report.price, price.to_f64()),
        };
        for (mechanism, concession) in self.venue.concessions() {
            *self.blotter.concessions.entry(mechanism).or_default() += concession * quantity.to_f64();
        }
        let fill_id = self.blotter.fills.len() as u64 + 1;
        let realised = closes.then_some(realised);
        let filled_at = time;
        self.blotter.fills.push(Fill {
            fill_id,
            order_id,
            instrument,
            filled_at,
            side,
            quantity,
            price,
            fee,
            realised,
            cost,
        });
        Ok(())
    }

    fn money(&self, event: Event, error: MoneyError) -> BacktestError {
        let symbol = &self.setup.instruments[event.instrument].symbol;
        BacktestError::Money { place: format!("{symbol} at {}", event.time), error }
    }
}
