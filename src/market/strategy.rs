//! What decides: a strategy sees the past and present, and asks for orders.

use crate::sim2real::Timestamp;

use super::halt::Halts;
use super::hours::TradingHours;
use super::known::Known;
use super::rates::multiplied;
use super::{
    Balance, Bar, Bracket, Calendar, Cash, Condition, CorporateAction, DepthBook, Hours, Increments, Instrument, Ledger,
    Link, Margin, OpenOrder, OrderId, OrderKind, Position, Price, Print, Quantity, QuoteSlice, Reason, Request, Role, Side,
    Terms, Ticket, UnderHalt,
};

/// What brought an event about; in the order in which they come at one instant.
// As wide as what stands beside it in an event: padding is copied in pieces, and reading pieces back as a whole takes longer than
// all else of a copy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u64)]
pub enum EventKind {
    /// A bar became known.
    Bar,
    /// Trades were printed.
    Trade,
    /// The book changed.
    Depth,
    /// A quote came to be.
    Quote,
    /// The strategy asked to be woken.
    Timer,
}

impl EventKind {
    /// Its word in tables.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Bar => "bar",
            Self::Trade => "trade",
            Self::Depth => "depth",
            Self::Quote => "quote",
            Self::Timer => "timer",
        }
    }
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

/// The past and the present, as far as a strategy may see them.
///
/// It shows what has become known, which is kept apart from what is still to come: there is no path from here to later data, nor
/// to the venue.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub(super) event: Event,
    pub(super) known: &'a [Known],
    pub(super) instruments: &'a [Instrument],
    pub(super) increments: &'a [Increments],
    pub(super) ledger: &'a Ledger,
    pub(super) equity: Cash,
    pub(super) hours: &'a [Option<TradingHours>],
    pub(super) halts: &'a [Halts],
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
        self.known.get(instrument).map_or(&[], |known| known.bars.newest(known.keep))
    }

    /// The quotes of an instrument by now, oldest first: at most as many as [`Strategy::lookback`] asks for.
    #[must_use]
    pub fn quotes(&self, instrument: usize) -> QuoteSlice<'a> {
        self.known.get(instrument).map_or_else(QuoteSlice::default, |known| known.quotes.newest(known.keep))
    }

    /// The trades printed of an instrument by now, oldest first: at most as many as [`Strategy::lookback`] asks for.
    #[must_use]
    pub fn prints(&self, instrument: usize) -> &'a [Print] {
        self.known.get(instrument).map_or(&[], |known| known.prints.newest(known.keep))
    }

    /// The book of an instrument as far as it is known by now, where its data have one.
    #[must_use]
    pub fn book(&self, instrument: usize) -> Option<&'a DepthBook> {
        self.known.get(instrument)?.book.as_ref()
    }

    /// The best price displayed on `side` (bids: [`Side::Buy`]), by the book or else the last quote.
    #[inline]
    #[must_use]
    pub fn best(&self, instrument: usize, side: Side) -> Option<Price> {
        let known = self.known.get(instrument)?;
        if let Some(book) = &known.book {
            return book.best(side);
        }
        let quote = known.quotes.newest(1).last()?;
        let best = if side == Side::Buy { quote.bid() } else { quote.ask() };
        Price::nearest(best?).ok()
    }

    /// The price on a tick nearest to `price` [currency] that an order of `side` may rest at: a bid is moved down, an ask up; none
    /// where there is no such price.
    #[must_use]
    pub fn restable(&self, instrument: usize, side: Side, price: f64) -> Option<Price> {
        let price = Price::nearest(price).ok().filter(|price| price.0 > 0)?;
        Some(self.increments.get(instrument)?.against(side.opposite(), price)).filter(|price| price.0 > 0)
    }

    /// One tick of an instrument; 0 where there is no such instrument.
    #[must_use]
    pub fn tick(&self, instrument: usize) -> Price {
        self.increments.get(instrument).map_or(Price(0), |steps| steps.tick())
    }

    /// The largest whole number of lots within `quantity`, towards 0.
    #[must_use]
    pub fn whole_lots(&self, instrument: usize, quantity: Quantity) -> Quantity {
        self.increments.get(instrument).map_or(Quantity::ZERO, |steps| steps.whole_lots(quantity))
    }

    /// `quantity` and one lot more of an instrument.
    #[must_use]
    pub fn next_lot(&self, instrument: usize, quantity: Quantity) -> Quantity {
        self.increments.get(instrument).map_or(quantity, |steps| quantity + steps.lot())
    }

    /// The session of an instrument now, with its open and close; none while its market is closed, and where it has no
    /// calendar.
    #[must_use]
    pub fn session(&self, instrument: usize) -> Option<Hours> {
        self.hours.get(instrument)?.as_ref()?.session_at(self.event.time)
    }

    /// When the market of an instrument is open, where its run says so.
    #[must_use]
    pub fn calendar(&self, instrument: usize) -> Option<&'a Calendar> {
        Some(self.hours.get(instrument)?.as_ref()?.calendar())
    }

    /// The halt an instrument is in now: when it ends is not known.
    #[must_use]
    pub fn halt(&self, instrument: usize) -> Option<UnderHalt<'a>> {
        self.halts.get(instrument)?.under_way(self.event.time)
    }

    /// Our orders of an instrument that work, as far as is known, the oldest first.
    #[inline]
    #[must_use]
    pub fn orders(&self, instrument: usize) -> &'a [OpenOrder] {
        self.known.get(instrument).map_or(&[], |known| &known.orders)
    }

    /// The latest price of an instrument: the close of its last bar, or its last mid.
    #[must_use]
    pub fn price(&self, instrument: usize) -> Option<Price> {
        self.known.get(instrument)?.mark
    }

    /// What is held of an instrument, negative when short.
    #[must_use]
    pub fn position(&self, instrument: usize) -> Quantity {
        self.ledger.positions().get(instrument).map_or(Quantity::ZERO, |position| position.quantity)
    }

    /// Fees paid on an instrument so far [its currency].
    #[must_use]
    pub fn fees(&self, instrument: usize) -> f64 {
        self.ledger.positions().get(instrument).map_or(0.0, |position| position.fees.to_f64())
    }

    /// What is held of an instrument would gain if it were closed at its mark, before fees [its currency].
    #[inline]
    #[must_use]
    pub fn unrealized(&self, instrument: usize) -> f64 {
        let gain = |position: &Position| position.value().to_f64() - position.basis.to_f64();
        self.ledger.positions().get(instrument).map_or(0.0, gain)
    }

    /// What is under way of an instrument and would change the position: positive for buys. Orders that only close what is
    /// held are left out.
    #[must_use]
    pub fn working(&self, instrument: usize) -> Quantity {
        self.known.get(instrument).map_or(Quantity::ZERO, |known| known.working)
    }

    /// Cash in hand, in the currency of the run.
    #[must_use]
    pub fn cash(&self) -> Cash {
        self.ledger.cash()
    }

    /// What there is in each currency, first in that of the run.
    #[must_use]
    pub fn balances(&self) -> &'a [Balance] {
        self.ledger.balances()
    }

    /// The terms an instrument is held on: its currency, multiplier and margin.
    #[must_use]
    pub fn terms(&self, instrument: usize) -> Terms {
        self.ledger.terms().get(instrument).copied().unwrap_or_default()
    }

    /// Equity beside what the positions require; none where they have no margin that could be told: a currency has no rate yet.
    #[must_use]
    pub fn margin(&self) -> Option<Margin> {
        self.ledger.margin().ok()
    }

    /// What one unit of an instrument is worth at its latest price, with its multiplier [currency of the run]; none where there
    /// is no price, or no rate yet.
    #[must_use]
    pub fn unit_value(&self, instrument: usize) -> Option<f64> {
        let (price, terms) = (self.price(instrument)?, self.terms(instrument));
        let rate = match terms.currency {
            0 => 1.0,
            other => self.ledger.balances().get(other)?.rate?.to_f64(),
        };
        Some(price.to_f64() * multiplied(rate, terms.multiplier))
    }

    /// Cash and what all positions are worth, in the currency of the run.
    #[must_use]
    pub fn equity(&self) -> Cash {
        self.equity
    }

    /// The whole lots of an instrument that `amount` [currency of the run] is worth at its latest price; 0 where there is no
    /// price or no rate, or the amount is not above 0.
    #[must_use]
    pub fn lots_worth(&self, instrument: usize, amount: f64) -> Quantity {
        let (Some(value), Some(steps)) = (self.unit_value(instrument), self.increments.get(instrument)) else {
            return Quantity::ZERO;
        };
        let units = amount / value;
        if units > 0.0 { Quantity::nearest(units).map_or(Quantity::ZERO, |q| steps.whole_lots(q)) } else { Quantity::ZERO }
    }
}

/// Collects what a strategy asks for at one event.
#[derive(Debug, Clone, Default)]
pub struct Orders {
    requests: Vec<Request>,
    /// Orders asked for so far in the run.
    asked: u64,
}

impl Orders {
    /// Asks for an order, and gives its id.
    pub fn submit(&mut self, ticket: Ticket) -> OrderId {
        let id = self.number();
        self.requests.push(Request::Submit(id, ticket));
        id
    }

    /// The number of an order that somebody else sends.
    pub(super) fn number(&mut self) -> OrderId {
        self.asked += 1;
        OrderId(self.asked)
    }

    /// Asks for a market order.
    pub fn market(&mut self, instrument: usize, side: Side, quantity: Quantity) -> OrderId {
        self.submit(Ticket::market(instrument, side, quantity))
    }

    /// Asks for a limit order that works until it is filled or cancelled.
    pub fn limit(&mut self, instrument: usize, side: Side, quantity: Quantity, price: Price) -> OrderId {
        self.submit(Ticket::limit(instrument, side, quantity, price))
    }

    /// Asks for an entry and two exits that wait for it: what the entry fills may leave with a gain at `take_profit` or with a
    /// loss at `stop_loss`, and one cancels the other.
    pub fn bracket(&mut self, entry: Ticket, take_profit: Price, stop_loss: Price) -> Bracket {
        let parent = self.submit(entry);
        let exit = |kind| {
            Ticket::new(entry.instrument, entry.side.opposite(), entry.quantity, kind)
                .linked(Link::ChildOf { parent })
                .on(Condition::ReduceOnly)
        };
        let take_profit = self.submit(exit(OrderKind::Limit { price: take_profit }));
        let stop_loss = self.submit(exit(OrderKind::Stop { trigger: stop_loss }));
        Bracket { entry: parent, take_profit, stop_loss }
    }

    /// Asks for orders of one instrument of which one cancels the others: what one fills, the others no longer do. Gives their
    /// ids, which follow one another.
    pub fn one_cancels_other(&mut self, tickets: &[Ticket]) -> Vec<OrderId> {
        let group = OrderId(self.asked + 1);
        tickets.iter().map(|ticket| self.submit(ticket.linked(Link::OneCancelsOther { group }))).collect()
    }

    /// Asks to take an order back.
    pub fn cancel(&mut self, id: OrderId) {
        self.requests.push(Request::Cancel(id));
    }

    /// Asks to change an order: its quantity in all, what was filled included, and its limit, or the trigger of a stop.
    pub fn replace(&mut self, id: OrderId, quantity: Option<Quantity>, price: Option<Price>) {
        self.requests.push(Request::Replace { id, quantity, price });
    }

    /// Asks to be woken at an instant, or at once where that is past.
    pub fn wake_at(&mut self, time: Timestamp) {
        self.requests.push(Request::Wake(time));
    }

    /// Asks for the market order that takes the position of `instrument`, with what is on its way, to `target`; for none
    /// where it is there already.
    pub fn to_position(&mut self, view: &View<'_>, instrument: usize, target: Quantity) {
        let missing = target - view.position(instrument) - view.working(instrument);
        match missing.0.signum() {
            1 => self.market(instrument, Side::Buy, missing),
            -1 => self.market(instrument, Side::Sell, missing.abs()),
            _ => return,
        };
    }

    /// What was asked for.
    #[must_use]
    pub fn requests(&self) -> &[Request] {
        &self.requests
    }

    /// Turns what was asked for into something else, request by request.
    #[cfg(feature = "io")]
    pub(super) fn turn(&mut self, turned: impl FnMut(Request) -> Request) {
        self.requests = std::mem::take(&mut self.requests).into_iter().map(turned).collect();
    }

    /// Forgets it all; numbers go on.
    pub fn clear(&mut self) {
        self.requests.clear();
    }
}

/// What became of an order, as it becomes known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Notice {
    /// The order.
    pub order_id: OrderId,
    /// Number of its instrument.
    pub instrument: usize,
    /// Its side.
    pub side: Side,
    /// When it happened.
    pub at: Timestamp,
    /// What happened.
    pub news: News,
}

/// What can become of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum News {
    /// Some of it was filled.
    Filled {
        /// How much.
        quantity: Quantity,
        /// At which price.
        price: Price,
        /// As what.
        role: Role,
        /// How much of it is left.
        left: Quantity,
    },
    /// It works no longer, though some of it is left.
    Ended(Reason),
    /// Its stop was set off.
    SetOff,
    /// It was changed as asked.
    Replaced,
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
    /// Learns what became of one of its orders, and may ask for more.
    fn on_notice(&mut self, _view: &View<'_>, _notice: &Notice, _orders: &mut Orders) {}
    /// Learns of a dividend or a split of an instrument, and may ask for orders. The account has booked it, and what works
    /// of its own orders is told in the new units; bars and quotes of before are not: they stay as they were printed.
    fn on_action(&mut self, _view: &View<'_>, _action: &CorporateAction, _orders: &mut Orders) {}
    /// The same with all it remembers, for a run that is forked; none where it cannot be copied: such a run is repeated.
    fn copied(&self) -> Option<Box<dyn Strategy>> {
        None
    }
}
