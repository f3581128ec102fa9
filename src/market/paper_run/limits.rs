//! Limits of a paper run: what a strategy asks for beyond them is refused, and trading stops where too much was lost.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::PathBuf;

use serde::Deserialize;

use crate::io::{InputError, RunFile};
use crate::market::{
    Cash, Condition, CorporateAction, Notice, OrderId, Orders, Quantity, Reason, Request, Side, Strategy, Ticket, View,
};
use crate::sim2real::Timestamp;

/// `[paper]` of RUN.toml. A limit that is not given does not hold.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaperSettings {
    /// Largest order [units].
    pub max_order: Option<f64>,
    /// Largest position of a symbol, long or short, with all orders that work on its side [units].
    pub max_position: Option<f64>,
    /// The same, at the latest price [currency of the run].
    pub max_position_value: Option<f64>,
    /// Most orders and replacements within a minute of the feed.
    pub orders_a_minute: Option<usize>,
    /// Largest loss from the start [currency of the run]; beyond it, trading stops.
    pub max_loss: Option<f64>,
    /// Largest loss from the highest equity so far [currency of the run]; beyond it, trading stops.
    pub max_drawdown: Option<f64>,
    /// What happens when trading stops.
    #[serde(default)]
    pub on_loss: OnLoss,
    /// A file; once it is there, the session ends. Its path starts from the folder of RUN.toml.
    pub kill_file: Option<PathBuf>,
}

/// What happens when too much was lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OnLoss {
    /// Orders that work are cancelled; what is held is kept.
    #[default]
    Cancel,
    /// What is held is sold or bought back by market orders, too.
    Flatten,
}

impl PaperSettings {
    /// `[paper]` of a run; its paths start from where the program runs.
    ///
    /// # Errors
    /// Keys there are none of, and limits that are not above 0.
    pub fn read(run: &RunFile) -> Result<Self, InputError> {
        let settings: Self = run.paper()?;
        let amounts = [
            ("max_order", settings.max_order),
            ("max_position", settings.max_position),
            ("max_position_value", settings.max_position_value),
            ("orders_a_minute", settings.orders_a_minute.map(|count| count as f64)),
            ("max_loss", settings.max_loss),
            ("max_drawdown", settings.max_drawdown),
        ];
        for (key, value) in amounts.into_iter().filter_map(|(key, value)| Some((key, value?))) {
            if !value.is_finite() || value <= 0.0 {
                let error = run.error(&["paper", key], "expected a finite number greater than 0").found(value);
                return Err(error.hint("drop the key for no limit"));
            }
        }
        let kill_file = settings.kill_file.as_ref().map(|path| run.document().resolve(path));
        Ok(Self { kill_file, ..settings })
    }
}

/// A strategy within limits. Within them it is the strategy, to the bit.
pub(super) struct Limited {
    inner: Box<dyn Strategy>,
    settings: PaperSettings,
    /// When orders were let through within the last minute.
    sent: VecDeque<Timestamp>,
    start: Option<Cash>,
    peak: Option<Cash>,
    /// Why and when trading stopped.
    lost: Option<Loss>,
    /// Orders that were taken back since.
    cancelled: BTreeSet<OrderId>,
}

/// A loss beyond a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// When.
    pub at: Timestamp,
    /// The limit: `max_loss` or `max_drawdown`.
    pub limit: &'static str,
    /// How much was lost [currency of the run].
    pub lost: f64,
    /// How much was allowed [currency of the run].
    pub allowed: f64,
}

const MINUTE: i64 = 60 * Timestamp::NANOS;

impl Limited {
    pub fn new(inner: Box<dyn Strategy>, settings: PaperSettings) -> Self {
        let (sent, cancelled) = Default::default();
        Self { inner, settings, sent, start: None, peak: None, lost: None, cancelled }
    }

    /// Why and when trading stopped, if it did.
    pub fn loss(&self) -> Option<Loss> {
        self.lost
    }

    /// Looks at the equity; whether trading goes on.
    fn may_trade(&mut self, view: &View<'_>) -> bool {
        let equity = view.equity();
        let start = *self.start.get_or_insert(equity);
        let peak = self.peak.map_or(equity, |peak| peak.max(equity));
        self.peak = Some(peak);
        let lost_from = |from: Cash| from.to_f64() - equity.to_f64();
        let [from_start, from_peak] = [start, peak].map(lost_from);
        let limits =
            [("max_loss", self.settings.max_loss, from_start), ("max_drawdown", self.settings.max_drawdown, from_peak)];
        if self.lost.is_none() {
            let beyond = limits.into_iter().find_map(|(limit, allowed, lost)| {
                let allowed = allowed.filter(|allowed| lost > *allowed)?;
                Some(Loss { at: view.now(), limit, lost, allowed })
            });
            self.lost = beyond;
        }
        self.lost.is_none()
    }

    /// Takes back what works, and closes what is held where that is wanted.
    fn wind_down(&mut self, view: &View<'_>, orders: &mut Orders) {
        for k in 0..view.instruments().len() {
            let working = view.orders(k);
            working.iter().filter(|order| self.cancelled.insert(order.id)).for_each(|order| orders.cancel(order.id));
            // An order that closes the position works until it is filled; it must be neither sent twice nor taken back.
            if working.is_empty() && self.settings.on_loss == OnLoss::Flatten && view.position(k) != Quantity::ZERO {
                let position = view.position(k);
                let side = if position > Quantity::ZERO { Side::Sell } else { Side::Buy };
                let id = orders.submit(Ticket::market(k, side, position.abs()).on(Condition::ReduceOnly));
                self.cancelled.insert(id);
            }
        }
    }

    /// Lets the strategy ask, and refuses what is beyond the limits.
    fn within(&mut self, view: &View<'_>, orders: &mut Orders, asks: impl FnOnce(&mut dyn Strategy, &mut Orders)) {
        if !self.may_trade(view) {
            return self.wind_down(view, orders);
        }
        asks(self.inner.as_mut(), orders);
        if orders.requests().is_empty() {
            return;
        }
        let mut coming = Coming::default();
        orders.turn(|request| match self.beyond(view, &request, &mut coming) {
            None => request,
            Some((instrument, side, quantity, reason)) => Request::Refused { instrument, side, quantity, reason },
        });
    }

    /// What of a request is beyond a limit, and beyond which.
    fn beyond(
        &mut self,
        view: &View<'_>,
        request: &Request,
        coming: &mut Coming,
    ) -> Option<(usize, Side, Quantity, Reason)> {
        let (instrument, side, whole, more, closes) = match *request {
            Request::Submit(_, ticket) => {
                let closes = ticket.condition == Condition::ReduceOnly;
                (ticket.instrument, ticket.side, ticket.quantity, ticket.quantity, closes)
            }
            Request::Replace { id, quantity, .. } => {
                let all = 0..view.instruments().len();
                let (k, order) =
                    all.flat_map(|k| view.orders(k).iter().map(move |order| (k, order))).find(|(_, o)| o.id == id)?;
                let whole = quantity.unwrap_or(order.left);
                // What was filled already is in the new quantity, too: this is no less than what comes to be added.
                (k, order.side, whole, (whole - order.left).max(Quantity::ZERO), order.closes)
            }
            Request::Cancel(_) | Request::Wake(_) | Request::Refused { .. } => return None,
        };
        let refused = |reason| Some((instrument, side, whole, reason));
        if self.settings.max_order.is_some_and(|largest| whole.to_f64() > largest) {
            return refused(Reason::OrderLimit);
        }
        let after = coming.position_after(view, instrument, side, more);
        if !closes && more > Quantity::ZERO && self.is_too_much(view, instrument, after) {
            return refused(Reason::PositionLimit);
        }
        if !self.is_in_time(view.now()) {
            return refused(Reason::OrderRate);
        }
        if !closes {
            coming.add(instrument, side, more);
        }
        None
    }

    /// Whether a position of `units` is beyond a limit.
    fn is_too_much(&self, view: &View<'_>, instrument: usize, units: f64) -> bool {
        let value = || view.unit_value(instrument).map(|one| (units * one).abs());
        let beyond =
            |limit: Option<f64>, found: Option<f64>| limit.zip(found).is_some_and(|(largest, found)| found > largest);
        units > 0.0 && (beyond(self.settings.max_position, Some(units)) || beyond(self.settings.max_position_value, value()))
    }

    /// Whether one order more may be sent within this minute; it is counted then.
    fn is_in_time(&mut self, now: Timestamp) -> bool {
        let Some(most) = self.settings.orders_a_minute else { return true };
        while self.sent.front().is_some_and(|sent| *sent + MINUTE <= now) {
            self.sent.pop_front();
        }
        let free = self.sent.len() < most;
        if free {
            self.sent.push_back(now);
        }
        free
    }
}

/// What was asked for at this event already, by instrument and side.
#[derive(Default)]
struct Coming(BTreeMap<(usize, bool), Quantity>);

impl Coming {
    fn add(&mut self, instrument: usize, side: Side, more: Quantity) {
        let own = self.0.entry((instrument, side == Side::Buy)).or_insert(Quantity::ZERO);
        *own = *own + more;
    }

    /// What would be held on `side` [units] were everything filled that works there, and `more`; nothing on the other side.
    fn position_after(&self, view: &View<'_>, instrument: usize, side: Side, more: Quantity) -> f64 {
        let working = view.orders(instrument).iter().filter(|order| order.side == side && !order.closes);
        let working: f64 = working.map(|order| order.left.to_f64()).sum();
        let asked = self.0.get(&(instrument, side == Side::Buy)).copied().unwrap_or(Quantity::ZERO);
        view.position(instrument).to_f64() * side.sign() + working + asked.to_f64() + more.to_f64()
    }
}

impl Strategy for Limited {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn lookback(&self) -> usize {
        self.inner.lookback()
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.within(view, orders, |inner, orders| inner.on_event(view, orders));
    }

    fn on_notice(&mut self, view: &View<'_>, notice: &Notice, orders: &mut Orders) {
        self.within(view, orders, |inner, orders| inner.on_notice(view, notice, orders));
    }

    fn on_action(&mut self, view: &View<'_>, action: &CorporateAction, orders: &mut Orders) {
        self.within(view, orders, |inner, orders| inner.on_action(view, action, orders));
    }
}
