//! The floor on which one instrument is traded: the orders that wait there, and what fills them.

use crate::market::account::Ratio;
use crate::market::{
    AnotherFill, Book, Condition, Execution, InFlight, Increments, Link, Met, OrderId, Price, Quantity, Reason, Reference,
    Role, Side, WhileHalted,
};
use crate::sim2real::{Run, Tick, Timestamp};

use super::auction::Auctions;
use super::by_order::Others;
use super::moved::Moved;
use super::queue::Place;
use super::resting::{Filled, Outcome, Resting, What};
use super::shown::Shown;
use super::taken::Taken;
use super::{Intrabar, LimitFill, QueueModel};

/// How a venue fills orders, as far as that is no mechanism.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::market) struct Rules {
    pub reference: Reference,
    pub intrabar: Intrabar,
    pub limit_fill: LimitFill,
    pub queue: QueueModel,
    pub halted: WhileHalted,
    /// Whether the data show what own orders did to the market.
    pub shows_own: bool,
    /// The first message's time is this of the run [ns]: laws count from it.
    pub origin: Timestamp,
}

/// What a fill is made against.
#[derive(Debug, Clone, Copy)]
pub(super) struct Offer {
    pub at: Timestamp,
    /// Price before mechanisms [currency].
    pub reference: f64,
    pub mid: f64,
    pub book: Book,
    /// Volume the order may be a part of [units].
    pub volume: f64,
    pub row: usize,
    pub band: [Price; 2],
}

/// The floor of one instrument.
#[derive(Clone)]
pub(in crate::market) struct Floor {
    pub(super) number: usize,
    pub(super) rules: Rules,
    pub(super) run: Run<Execution>,
    pub(super) increments: Increments,
    /// Prices of fills move in these: ticks, unless a mechanism averages over several trades.
    pub(super) fill_increments: Increments,
    pub(super) resting: Vec<Resting>,
    pub(super) shown: Shown,
    /// What is held by what was filled here, whether or not anybody knows yet.
    pub(super) held: Quantity,
    /// What was taken of the volume that is there now.
    pub(super) taken: Taken,
    /// Number of the row that is there now: of bars, quotes, trades, changes of the book.
    pub(super) rows: [usize; 4],
    /// Bars within which the order of the extremes decided what was filled.
    pub(super) ambiguous: usize,
    /// Bars are there, and nothing finer.
    pub(super) by_bars: bool,
    /// The data know the orders of others one by one.
    pub(super) by_order: bool,
    /// Instant and price of the last trade that met own orders: what else is traded then and there goes through the same queue.
    pub(super) printed: Option<(Timestamp, Price)>,
    /// A law has something to say of the queues that orders join.
    pub(super) asks_queue: bool,
    /// How far own orders have moved the market.
    pub(super) moved: Moved,
    pub(super) others: Others,
    /// Its hours, where they are known; else it never closes.
    pub auctions: Option<Auctions>,
    pub(super) messages: usize,
    pub(super) outcomes: Vec<Outcome>,
    /// What each mechanism that acts on prices added to the price of the last fill [currency].
    pub(super) concessions: Vec<f64>,
    /// The same of each fill among the outcomes, in their order.
    pub(super) terms: Vec<f64>,
    /// Fills that are to be others than they would be.
    pub(super) instead: Vec<(OrderId, AnotherFill)>,
}

impl Floor {
    pub(super) fn new(
        number: usize,
        increments: Increments,
        averages: bool,
        conceding: usize,
        rules: Rules,
        run: Run<Execution>,
    ) -> Self {
        Self {
            number,
            rules,
            run,
            increments,
            fill_increments: if averages { increments.without_tick() } else { increments },
            resting: Vec::new(),
            shown: Shown::Nothing,
            held: Quantity::ZERO,
            taken: Taken::default(),
            rows: [0; 4],
            ambiguous: 0,
            by_bars: false,
            by_order: false,
            printed: None,
            asks_queue: false,
            moved: Moved::default(),
            others: Others::default(),
            auctions: None,
            messages: 0,
            outcomes: Vec::new(),
            concessions: vec![0.0; conceding],
            terms: Vec::new(),
            instead: Vec::new(),
        }
    }

    /// The time of a message for the laws.
    pub(super) fn tick(&mut self, time: Timestamp) -> Tick {
        let index = self.messages;
        self.messages += 1;
        Tick { index, time: time.seconds_since(self.rules.origin), step: 0.0 }
    }

    /// Gives an order to the laws of commands, which say when it arrives and how large it may be.
    pub fn shape(&mut self, order: &InFlight) -> InFlight {
        let tick = self.tick(order.decided_at);
        self.run.send(tick, order).first().copied().unwrap_or(*order)
    }

    /// Shows `seen` what a position that is held is charged, from when it was charged last to `now`, by each law of reports and
    /// those before it together [currency].
    pub fn charge(&mut self, held: &InFlight, mid: f64, now: Timestamp, mut seen: impl FnMut(usize, f64)) {
        let tick = self.tick(now);
        self.run.deliver(&[held.as_a(Role::Holder).arriving(now)]);
        self.run.advance(tick, |_| Met::at(Book::at_price(now, mid), mid, f64::INFINITY));
        self.run.observe_seen(tick.time, |law, reports| seen(law, reports.first().map_or(0.0, |report| report.fee)));
    }

    /// How much of order `k` may be filled now: a reduce-only order no more than closes what is held.
    pub(super) fn allowed(&self, k: usize) -> Quantity {
        let order = &self.resting[k];
        let tradable = order.tradable();
        if order.condition != Condition::ReduceOnly {
            return tradable;
        }
        let closes = match order.side {
            Side::Buy => (-self.held).max(Quantity::ZERO),
            Side::Sell => self.held.max(Quantity::ZERO),
        };
        tradable.min(closes)
    }

    /// Order `k` takes from `offer`, at most `most`.
    pub(super) fn take(&mut self, k: usize, offer: &Offer, most: Quantity) {
        let order = &self.resting[k];
        let (side, limit) = (order.side, order.limit());
        let mut wanted = self.increments.whole_lots(self.allowed(k).min(most));
        let cap = order.order.participation_limit;
        if cap.is_finite() {
            // Earlier orders took their part of the same volume.
            let left = (cap * offer.volume - self.taken.by(side)).max(0.0);
            wanted = wanted.min(self.increments.whole_lots(Quantity::nearest(left.min(9e9)).unwrap_or(wanted)));
        }
        self.resting[k].met = true;
        wanted = self.within_limit(k, offer, wanted);
        if wanted <= Quantity::ZERO {
            return;
        }
        let arriving = InFlight { quantity: wanted.to_f64(), ..self.resting[k].order.as_a(Role::Taker) };
        let (model_price, quantity, fee) = self.met_whole_lots(&arriving, offer, wanted);
        if quantity <= Quantity::ZERO {
            return;
        }
        self.taken.add(side, quantity.to_f64());
        // An order with a limit pays no more than that, whatever mechanisms say.
        let (mut price, mut model_price) = (self.rounded(side, model_price), model_price);
        if let Some(limit) = limit.filter(|limit| !side.accepts(price, *limit)) {
            (price, model_price) = (limit, limit.to_f64());
        }
        self.fill(k, Role::Taker, quantity, price, model_price, fee, offer);
    }

    /// Lets an order for `wanted` meet an offer: price, whole lots filled, and fee.
    pub(super) fn met_whole_lots(&mut self, arriving: &InFlight, offer: &Offer, wanted: Quantity) -> (f64, Quantity, f64) {
        let (model_price, filled, quantity, fee) = self.meet(arriving, offer);
        // A quantity beyond 2^53 steps does not come back from a float as it went in: what is filled whole is whole.
        let reported = Quantity::nearest(quantity).unwrap_or(wanted);
        let whole = filled >= 1.0 || reported >= wanted;
        (model_price, if whole { wanted } else { self.increments.whole_lots(reported).min(wanted) }, fee)
    }

    /// Order `k`, which rests, is taken by others: `quantity` of it at its limit.
    pub(super) fn make(&mut self, k: usize, offer: &Offer, quantity: Quantity) {
        let wanted = self.increments.whole_lots(self.allowed(k).min(quantity));
        let Some(limit) = self.resting[k].limit().filter(|_| wanted > Quantity::ZERO) else { return };
        let arriving = InFlight {
            quantity: wanted.to_f64(),
            participation_limit: f64::INFINITY,
            ..self.resting[k].order.as_a(Role::Maker)
        };
        let offer = Offer { reference: limit.to_f64(), ..*offer };
        let (_, _, _, fee) = self.meet(&arriving, &offer);
        // It fills at its limit and nowhere else: what mechanisms hold against it is charged.
        let charged: f64 = self.concessions.iter().sum::<f64>() * wanted.to_f64() * arriving.multiplier;
        self.fill(k, Role::Maker, wanted, limit, limit.to_f64(), fee + charged, &offer);
    }

    /// Lets an order meet an offer: price, part filled, quantity and fee.
    pub(super) fn meet(&mut self, arriving: &InFlight, offer: &Offer) -> (f64, f64, f64, f64) {
        let tick = self.tick(offer.at);
        let shows_own = self.rules.shows_own;
        let met = Met { shows_own, ..Met::at(offer.book, offer.reference, offer.volume) };
        self.run.deliver(&[*arriving]);
        let (concessions, mut before) = (&mut self.concessions, 0.0);
        self.run.advance_seen(
            tick,
            |_| met,
            |law, effects| {
                let after = effects.first().map_or(0.0, |effect| effect.paid(arriving, &met));
                if let Some(own) = concessions.get_mut(law) {
                    *own = after - before;
                }
                before = after;
            },
        );
        let report = self.run.observe(tick.time).first().copied().unwrap_or_default();
        (report.price, report.filled, report.quantity, report.fee)
    }

    /// A price on a tick; 0 where there is none that could be.
    pub(super) fn rounded(&self, side: Side, price: f64) -> Price {
        Price::nearest(price).map_or(Price(0), |price| self.fill_increments.against(side, price))
    }

    #[allow(clippy::too_many_arguments, reason = "they are the parts of one fill")]
    fn fill(&mut self, k: usize, role: Role, quantity: Quantity, price: Price, model_price: f64, fee: f64, offer: &Offer) {
        let (quantity, price, model_price) = match self.another(k) {
            Some((quantity, price)) => (quantity, price, price.to_f64()),
            None => (quantity, price, model_price),
        };
        let order = &mut self.resting[k];
        order.left = order.left - quantity;
        order.released = order.released - quantity;
        order.filled = order.filled + quantity;
        let (id, side, link) = (order.id, order.side, order.link);
        let queued_behind = if role == Role::Maker { order.place.joined_behind } else { 0.0 };
        self.held = self.held + quantity.signed(side);
        let filled = Filled {
            role,
            quantity,
            price,
            model_price,
            mid: offer.mid,
            fee,
            queued_behind,
            row: offer.row,
            band: offer.band.map(|price| price.plus(self.moved.by())),
            displaced: self.moved.by(),
        };
        self.terms.extend_from_slice(&self.concessions);
        self.tell(id, offer.at, What::Filled(filled));
        self.settle_links(id, link, quantity, offer.at);
    }

    /// What order `k` is to be filled with instead, if anything.
    fn another(&mut self, k: usize) -> Option<(Quantity, Price)> {
        let order = &self.resting[k];
        let at = self.instead.iter().position(|(id, _)| *id == order.id)?;
        let (_, AnotherFill { quantity, price }) = self.instead.swap_remove(at);
        Some((quantity.unwrap_or(order.left).min(order.left), price))
    }

    /// A split: orders that wait are told in new units, and are given; those that fit no more are over. What was displayed
    /// before is there no longer, but for a book, of which the data say how it changes.
    pub fn split(&mut self, ratio: Ratio, held: Quantity, at: Timestamp) -> Vec<Resting> {
        self.held = held;
        self.taken = Taken::default();
        if !matches!(self.shown, Shown::Depth(_)) {
            self.shown = Shown::Nothing;
        }
        for k in 0..self.resting.len() {
            if !self.resting[k].split(ratio, self.increments) {
                self.end(k, at, Reason::Split);
            }
        }
        self.sweep(at);
        self.resting.clone()
    }

    pub(super) fn tell(&mut self, id: OrderId, at: Timestamp, what: What) {
        self.outcomes.push(Outcome { id, instrument: self.number, at, what });
    }

    /// What the fill of one order does to those it is linked with.
    fn settle_links(&mut self, id: OrderId, link: Link, quantity: Quantity, at: Timestamp) {
        if self.resting.len() == 1 {
            return; // Nobody else is there, as nearly always.
        }
        let (mut over, mut released) = (Vec::new(), Vec::new());
        for (k, order) in self.resting.iter_mut().enumerate().filter(|(_, order)| order.id != id) {
            if order.link == (Link::ChildOf { parent: id }) {
                // Children work for as much as their parent has filled.
                order.released = (order.released + quantity).min(order.left);
                released.push(k);
            } else if link != Link::Alone && order.link == link {
                order.left = order.left - quantity;
                order.released = (order.released - quantity).min(order.left).max(Quantity::ZERO);
                if order.left <= Quantity::ZERO {
                    over.push(order.id);
                }
            }
        }
        for id in over {
            self.tell(id, at, What::Ended(Reason::Linked));
        }
        if !self.by_bars && self.is_open() {
            // From now on they stand in a queue.
            released.into_iter().for_each(|k| self.join(k, at));
        }
    }

    /// Takes order `k` off the floor for `reason`, and its children, which then wait for nothing.
    pub(super) fn end(&mut self, k: usize, at: Timestamp, reason: Reason) {
        let order = &mut self.resting[k];
        order.left = Quantity::ZERO;
        let id = order.id;
        self.tell(id, at, What::Ended(reason));
    }

    /// Clears away the orders that are over, and what children wait for that their parents never fill.
    pub(super) fn sweep(&mut self, at: Timestamp) {
        if self.resting.iter().any(|order| matches!(order.link, Link::ChildOf { .. })) {
            self.sweep_children(at);
        }
        self.resting.retain(|order| order.left > Quantity::ZERO);
    }

    fn sweep_children(&mut self, at: Timestamp) {
        let alive: Vec<OrderId> = self.resting.iter().filter(|o| o.left > Quantity::ZERO).map(|o| o.id).collect();
        for k in 0..self.resting.len() {
            let order = &mut self.resting[k];
            if let Link::ChildOf { parent } = order.link
                && order.left > Quantity::ZERO
                && !alive.contains(&parent)
            {
                order.left = order.left.min(order.released);
                if order.left <= Quantity::ZERO {
                    self.end(k, at, Reason::Linked);
                }
            }
        }
    }

    /// Takes an order back as its owner asked, if it is still there.
    pub fn cancel(&mut self, id: OrderId, at: Timestamp, reason: Reason) -> bool {
        let Some(k) = self.resting.iter().position(|order| order.id == id) else { return false };
        self.end(k, at, reason);
        self.sweep(at);
        true
    }

    /// Changes an order as its owner asked, if it is still there: it goes to the end of the queue unless only its quantity
    /// shrinks.
    pub fn replace(&mut self, id: OrderId, quantity: Option<Quantity>, price: Option<Price>, at: Timestamp) -> bool {
        let Some(k) = self.resting.iter().position(|order| order.id == id) else { return false };
        let order = &mut self.resting[k];
        let filled = order.filled;
        let left = quantity.map_or(order.left, |whole| (whole - filled).max(Quantity::ZERO));
        let grows = left > order.left;
        let waits_for_parent = order.released < order.left;
        order.left = left;
        order.released = if waits_for_parent { order.released.min(left) } else { left };
        if let Some(price) = price {
            order.kind = order.kind.at(price);
        }
        let (whole, kind) = (left + filled, order.kind);
        self.tell(id, at, What::Replaced { quantity: whole, kind });
        if left <= Quantity::ZERO {
            self.end(k, at, Reason::Asked);
        } else if grows || price.is_some() {
            // Of own orders at one price it comes last from now on.
            let order = self.resting.remove(k);
            self.resting.push(order);
            let k = self.resting.len() - 1;
            if !self.by_bars && self.is_open() {
                // What may now take does, and what must not is over.
                self.resting[k].place = Place::default();
                self.displace(at);
                self.meet_shown(k, at);
            }
        }
        self.sweep(at);
        true
    }
}
