//! What decides: a strategy sees the past and present, and asks for orders.

use crate::sim2real::Timestamp;

use super::{Bar, Cash, Increments, Instrument, Ledger, Price, Quantity, QuoteSlice, Side};

/// What brought an event about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum EventKind {
    /// A bar became known.
    Bar,
    /// A quote came to be.
    Quote,
}

/// Something that became known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// When it could be known.
    pub time: Timestamp,
    /// Number of the instrument.
    pub instrument: usize,
    /// What it is.
    pub kind: EventKind,
}

/// What may be seen of one instrument: slices that end at the present, and hold nothing beyond.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Window<'a> {
    pub bars: &'a [Bar],
    pub quotes: QuoteSlice<'a>,
    pub mark: Option<Price>,
    /// Sent and not yet filled, cancelled or stranded: positive for buys.
    pub working: Quantity,
}

/// The past and the present, as far as a strategy may see them.
///
/// It is made of slices that end at the present: there is no path from here to later data, nor to the venue.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub(super) event: Event,
    pub(super) windows: &'a [Window<'a>],
    pub(super) instruments: &'a [Instrument],
    pub(super) increments: &'a [Increments],
    pub(super) ledger: &'a Ledger,
    pub(super) equity: Cash,
}

impl<'a> View<'a> {
    /// The present.
    #[must_use]
    pub fn now(&self) -> Timestamp {
        self.event.time
    }

    /// What just became known.
    #[must_use]
    pub fn event(&self) -> Event {
        self.event
    }

    /// The instruments of the run; their numbers are their places here.
    #[must_use]
    pub fn instruments(&self) -> &'a [Instrument] {
        self.instruments
    }

    /// The number of the instrument called `symbol`.
    #[must_use]
    pub fn find(&self, symbol: &str) -> Option<usize> {
        self.instruments.iter().position(|instrument| instrument.symbol == symbol)
    }

    /// The bars of an instrument known by now, oldest first: at most as many as [`Strategy::lookback`] asks for.
    #[must_use]
    pub fn bars(&self, instrument: usize) -> &'a [Bar] {
        self.windows.get(instrument).map_or(&[], |window| window.bars)
    }

    /// The quotes of an instrument by now, oldest first: at most as many as [`Strategy::lookback`] asks for.
    #[must_use]
    pub fn quotes(&self, instrument: usize) -> QuoteSlice<'a> {
        self.windows.get(instrument).map_or_else(QuoteSlice::default, |window| window.quotes)
    }

    /// The latest price of an instrument: the close of its last bar, or its last mid.
    #[must_use]
    pub fn price(&self, instrument: usize) -> Option<Price> {
        self.windows.get(instrument)?.mark
    }

    /// What is held of an instrument, negative when short.
    #[must_use]
    pub fn position(&self, instrument: usize) -> Quantity {
        self.ledger.positions().get(instrument).map_or(Quantity::ZERO, |position| position.quantity)
    }

    /// What was ordered of an instrument and has not met the market yet: positive for buys.
    #[must_use]
    pub fn working(&self, instrument: usize) -> Quantity {
        self.windows.get(instrument).map_or(Quantity::ZERO, |window| window.working)
    }

    /// Cash in hand.
    #[must_use]
    pub fn cash(&self) -> Cash {
        self.ledger.cash()
    }

    /// Cash and what all positions are worth.
    #[must_use]
    pub fn equity(&self) -> Cash {
        self.equity
    }

    /// The whole lots of an instrument that `amount` [currency] is worth at its latest price; 0 where there is no price
    /// or the amount is not above 0.
    #[must_use]
    pub fn lots_worth(&self, instrument: usize, amount: f64) -> Quantity {
        let (Some(price), Some(steps)) = (self.price(instrument), self.increments.get(instrument)) else {
            return Quantity::ZERO;
        };
        let units = amount / price.to_f64();
        if units > 0.0 { Quantity::nearest(units).map_or(Quantity::ZERO, |q| steps.whole_lots(q)) } else { Quantity::ZERO }
    }
}

/// An order a strategy asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request {
    /// Number of the instrument.
    pub instrument: usize,
    /// Which way.
    pub side: Side,
    /// How much.
    pub quantity: Quantity,
}

/// Collects the orders a strategy asks for at one event.
#[derive(Debug, Clone, Default)]
pub struct Orders {
    requests: Vec<Request>,
}

impl Orders {
    /// Asks for a market order.
    pub fn market(&mut self, instrument: usize, side: Side, quantity: Quantity) {
        self.requests.push(Request { instrument, side, quantity });
    }

    /// Asks for the market order that takes the position of `instrument`, with what is on its way, to `target`; for none
    /// where it is there already.
    pub fn to_position(&mut self, view: &View<'_>, instrument: usize, target: Quantity) {
        let missing = target - view.position(instrument) - view.working(instrument);
        match missing.0.signum() {
            1 => self.market(instrument, Side::Buy, missing),
            -1 => self.market(instrument, Side::Sell, missing.abs()),
            _ => {}
        }
    }

    /// What was asked for.
    #[must_use]
    pub fn requests(&self) -> &[Request] {
        &self.requests
    }

    /// Forgets it all.
    pub fn clear(&mut self) {
        self.requests.clear();
    }
}

/// Decides what to trade.
///
/// # Contract
/// - What it asks for depends on what it was shown, and on nothing else: no clock, no files, no entropy but a seed among
///   its parameters. Same views, same orders, to the bit.
/// - It keeps no more of the past than it needs: [`Strategy::lookback`] says how much it is shown.
///
/// [`check_strategy`](super::check_strategy) runs it.
pub trait Strategy: Send {
    /// Its id, as a run's `kind`.
    fn name(&self) -> &str;
    /// How many bars and quotes of each instrument it is shown, the newest counted; at least 1.
    fn lookback(&self) -> usize;
    /// Sees that something became known, and may ask for orders.
    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders);
}
