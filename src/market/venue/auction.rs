//! The open and the close of a floor whose hours are known, where quotes, books or trades are there.
//!
//! Auctions are in no feed of quotes: what an order for the open or the close gets is approximated by prices that were known
//! by then, and never by later ones.
//!
//! - **The open**: the first trade of the day where trades are known, else the best price of the first quote. Other orders that
//!   waited for the market to open meet that quote as if they arrived with it, and join the queues anew.
//! - **The close**: the last trade of the session up to the instant of its close, else the last price displayed, at which an
//!   order crosses the spread. The official close may be printed seconds later, and differ.
//!
//! An auction's volume is not known: only a cap on participation limits what is filled, to its part of the trade or of what is
//! displayed. Deadlines for such orders (New York: 15:50) are not kept.
//!
//! Source: NYSE rules 7.35A (core open) and 7.35B (closing auction), for what is approximated.

use crate::market::line::Line;
use crate::market::sources::RowKind;
use crate::market::{Book, OrderKind, Price, Quantity, Reason, Side, TimeInForce, WhileHalted};
use crate::sim2real::Timestamp;

use super::floor::{Floor, Offer};
use super::queue::Place;
use super::shown::Shown;
use super::taken::Taken;

/// Whether orders meet the market.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Doors {
    /// They do.
    Open,
    /// The session has begun, but shown no price yet.
    Opening,
    /// They wait.
    Closed,
}

/// A trade that was printed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Traded {
    price: Price,
    /// [units]
    size: f64,
}

/// What the data of a floor tell of its prices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Told {
    /// What is displayed: quotes, or a book.
    Displayed,
    /// What is traded.
    Traded,
    /// Both: the first trade of a day is its opening, but what there is to take the quotes say.
    Both,
}

/// The last price of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Last {
    /// There was none yet.
    None,
    /// It is displayed.
    Displayed,
    /// It was traded.
    Traded(Traded),
}

/// The hours of a floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::market) struct Auctions {
    doors: Doors,
    told: Told,
    /// The opening of the day is still to come.
    to_open: bool,
    last: Last,
    /// Trading is halted.
    halted: bool,
}

impl Auctions {
    /// Those of a floor with such data, whose market is closed yet.
    pub fn of(line: &Line) -> Self {
        let displayed = [RowKind::Quotes, RowKind::Depth, RowKind::Orders].iter().any(|kind| line.tells(*kind));
        let told = match (displayed, line.tells(RowKind::Trades)) {
            (true, false) => Told::Displayed,
            (true, true) => Told::Both,
            (false, _) => Told::Traded,
        };
        Self { doors: Doors::Closed, told, to_open: false, last: Last::None, halted: false }
    }

    /// Those of a floor without hours, which is open but for halts.
    pub fn always(line: &Line) -> Self {
        Self { doors: Doors::Open, ..Self::of(line) }
    }

    /// A session begins: what is known of its price is what is displayed, where its market was open before.
    fn begin_session(&mut self, doors: Doors, first_of_day: bool) {
        (self.doors, self.to_open) = (doors, first_of_day);
        self.last = if doors == Doors::Open { Last::Displayed } else { Last::None };
    }
}

impl Floor {
    /// Whether orders meet what is displayed.
    #[inline]
    pub(super) fn is_open(&self) -> bool {
        self.auctions.as_ref().is_none_or(|auctions| auctions.doors == Doors::Open && !auctions.halted)
    }

    /// The session is over.
    pub fn close_doors(&mut self) {
        if let Some(auctions) = &mut self.auctions {
            auctions.doors = Doors::Closed;
        }
    }

    /// A session begins after a time in which the market was closed. What was displayed before it is no price of it; a book
    /// that is told by its changes stays.
    pub fn open_doors(&mut self, first_of_day: bool) {
        let Some(auctions) = &mut self.auctions else { return };
        if self.by_bars {
            auctions.doors = Doors::Open;
            return;
        }
        auctions.begin_session(Doors::Opening, first_of_day);
        if !matches!(self.shown, Shown::Depth(_)) {
            self.shown = Shown::Nothing;
        }
        self.taken = Taken::default();
    }

    /// A session begins where the one before it ends, as days do in a market that never closes: what waits goes on waiting.
    pub fn go_on(&mut self, first_of_day: bool) {
        if let Some(auctions) = &mut self.auctions {
            auctions.begin_session(auctions.doors, first_of_day);
        }
    }

    /// Trading is halted.
    pub fn halt(&mut self) {
        if let Some(auctions) = &mut self.auctions {
            auctions.halted = true;
        }
    }

    /// Trading goes on where it was halted: with the first price that is shown from now on.
    pub fn resume(&mut self) {
        let Some(auctions) = &mut self.auctions else { return };
        if !std::mem::take(&mut auctions.halted) || auctions.doors == Doors::Closed || self.by_bars {
            return;
        }
        auctions.doors = Doors::Opening;
        if !matches!(self.shown, Shown::Depth(_)) {
            self.shown = Shown::Nothing;
        }
        self.taken = Taken::default();
    }

    /// Order `k` arrives, and the market does not trade: it waits, or is over.
    pub(super) fn wait_for_open(&mut self, k: usize, at: Timestamp) {
        let order = self.resting[k];
        if self.auctions.is_some_and(|auctions| auctions.halted) {
            let waits = !matches!(order.time_in_force, TimeInForce::ImmediateOrCancel | TimeInForce::FillOrKill);
            if self.rules.halted == WhileHalted::Refuse || !waits {
                self.end(k, at, Reason::Halted);
            }
            return;
        }
        let closed = self.auctions.is_some_and(|auctions| auctions.doors == Doors::Closed);
        if order.tradable() <= Quantity::ZERO {
            return;
        }
        match (order.time_in_force, closed) {
            (TimeInForce::ImmediateOrCancel | TimeInForce::FillOrKill, true) => self.end(k, at, Reason::MarketClosed),
            (TimeInForce::ImmediateOrCancel, false) => self.end(k, at, Reason::TimeInForce),
            (TimeInForce::FillOrKill, false) => self.end(k, at, Reason::FillOrKill),
            _ => {}
        }
    }

    /// What the market shows has changed: if that is the first price of a session, orders that waited for it meet it.
    pub fn begin(&mut self, at: Timestamp, by_trade: bool) {
        let Some(auctions) = self.auctions else { return };
        let opens = auctions.doors == Doors::Opening;
        let holds = auctions.to_open && auctions.told == Told::Displayed && auctions.doors != Doors::Closed;
        let tells = (!by_trade || auctions.told == Told::Traded) && !auctions.halted;
        if !(opens || holds) || !tells || !self.shows_price() {
            return;
        }
        let last = if auctions.last == Last::None { Last::Displayed } else { auctions.last };
        let to_open = auctions.to_open && !holds;
        self.auctions = Some(Auctions { doors: Doors::Open, to_open, last, ..auctions });
        if holds {
            self.open_at(at, None);
        }
        if opens {
            self.displace(at);
            for k in 0..self.resting.len() {
                self.resting[k].place = Place::default();
                self.meet_shown(k, at);
            }
        }
        self.sweep(at);
    }

    /// Whether a price is displayed. None are crossed: histories refuse such quotes, and books settle.
    fn shows_price(&self) -> bool {
        [Side::Buy, Side::Sell].into_iter().any(|side| self.shown.touch(side).is_some())
    }

    /// A trade is printed, in a session or out of it: the first of a day is its opening.
    pub(super) fn heed_print(&mut self, price: Price, size: f64, at: Timestamp) {
        // What is printed in a halt was traded before it.
        let Some(auctions) = self.auctions.as_mut().filter(|auctions| !auctions.halted) else { return };
        let traded = Traded { price, size };
        auctions.last = Last::Traded(traded);
        if auctions.to_open && auctions.doors != Doors::Closed {
            auctions.to_open = false;
            self.open_at(at, Some(traded));
            self.sweep(at);
        }
    }

    /// The opening auction: of the first trade, or else of what is displayed.
    fn open_at(&mut self, at: Timestamp, traded: Option<Traded>) {
        self.taken = Taken::default();
        for k in 0..self.resting.len() {
            if matches!(self.resting[k].kind, OrderKind::MarketOnOpen | OrderKind::LimitOnOpen { .. }) {
                self.take_part(k, at, traded);
            }
        }
        self.taken = Taken::default();
    }

    /// Whether an order for the close waits.
    pub fn awaits_close(&self) -> bool {
        self.resting.iter().any(|order| is_for_close(order.kind))
    }

    /// The day closes at `at`; `traded` says whether anything happened in the session that does.
    pub fn close_at(&mut self, at: Timestamp, traded: bool) {
        let last = self
            .auctions
            .filter(|auctions| traded && !self.by_bars && !auctions.halted)
            .map_or(Last::None, |auctions| auctions.last);
        self.taken = Taken::default();
        for k in 0..self.resting.len() {
            let order = self.resting[k];
            if !is_for_close(order.kind) || order.from >= at {
                continue;
            }
            match last {
                Last::None => self.end(k, at, Reason::NoAuction),
                Last::Displayed => self.take_part(k, at, None),
                Last::Traded(traded) => self.take_part(k, at, Some(traded)),
            }
        }
        self.taken = Taken::default();
        self.sweep(at);
    }

    /// Order `k` takes part in an auction at the price of a trade, or else at what is displayed; then it is over.
    fn take_part(&mut self, k: usize, at: Timestamp, traded: Option<Traded>) {
        let order = self.resting[k];
        let (price, offer) = match traded {
            Some(traded) => (Some(traded.price), Some(self.offer_traded(traded, at))),
            None => (self.touch_price(order.side), self.offer_shown(order.side, at)),
        };
        let (Some(price), Some(offer)) = (price, offer) else { return self.end(k, at, Reason::NoAuction) };
        if self.moved.reaches(&order, price) {
            self.take(k, &offer, order.tradable());
        }
        if self.resting[k].left > Quantity::ZERO {
            self.end(k, at, Reason::TimeInForce);
        }
    }

    /// What an auction at the price of a trade offers: one price for all, and no spread.
    fn offer_traded(&self, traded: Traded, at: Timestamp) -> Offer {
        let price = traded.price.to_f64();
        let (book, band) = (Book::at_price(at, price), [traded.price; 2]);
        Offer { at, reference: price, mid: price, book, volume: traded.size, row: self.row(), band }
    }
}

fn is_for_close(kind: OrderKind) -> bool {
    matches!(kind, OrderKind::MarketOnClose | OrderKind::LimitOnClose { .. })
}
