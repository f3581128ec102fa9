//! What the strategy is told: what became known, what became of its orders; and what it asks for then.

use crate::market::{Arrival, BacktestError, Bar, Cash, Event, EventKind, MoneyError, Orders, Price, Strategy, View};
use crate::sim2real::Timestamp;

use super::Session;

impl Session {
    /// Shows the strategy what became known, and sends what it asks for.
    #[inline(always)]
    pub(super) fn show(&mut self, arrival: &Arrival, strategy: &mut dyn Strategy) -> Result<Event, BacktestError> {
        let event = arrival.event;
        self.carry_over(event.time)?;
        self.learn(arrival, strategy.lookback().max(1)).map_err(|error| self.money(event, error))?;
        if self.keeping.is_some() {
            self.keep_account(arrival)?;
        }
        self.decide(event, strategy)
    }

    /// Shows what was on its way to the strategy.
    #[inline(never)]
    pub(super) fn show_late(&mut self, arrival: &Arrival, strategy: &mut dyn Strategy) -> Result<Event, BacktestError> {
        self.show(arrival, strategy)
    }

    #[inline(always)]
    pub(super) fn decide(&mut self, event: Event, strategy: &mut dyn Strategy) -> Result<Event, BacktestError> {
        let equity = self.ask(event, strategy)?;
        self.send_asked(event.time, equity);
        Ok(event)
    }

    /// Asks the strategy, and gives the equity it decided on.
    #[inline(always)]
    fn ask(&mut self, event: Event, strategy: &mut dyn Strategy) -> Result<Cash, BacktestError> {
        let equity = self.ledger.equity().map_err(|error| self.money(event, error))?;
        self.account(event.time, equity);
        let (view, orders) = self.view(event, equity);
        strategy.on_event(&view, orders);
        Ok(equity)
    }

    /// Shows the strategy a bar, where nothing else wants to be looked for; the equity it decided on, if it asked for anything.
    /// That is not sent yet.
    #[inline(always)]
    pub(super) fn show_bar(
        &mut self,
        instrument: usize,
        bar: &Bar,
        strategy: &mut dyn Strategy,
    ) -> Result<Option<Cash>, BacktestError> {
        let event = Event { time: bar.known_at, instrument, kind: EventKind::Bar };
        let known = &mut self.known[instrument];
        known.keep = strategy.lookback().max(1);
        known.bars.push(*bar, known.keep);
        known.mark = Some(bar.close);
        self.daily[instrument].see(event.time, bar.close, bar.volume);
        self.ledger.mark(instrument, bar.close).map_err(|error| self.money(event, error))?;
        let equity = self.ask(event, strategy)?;
        Ok(if self.orders.requests().is_empty() { None } else { Some(equity) })
    }

    #[inline(always)]
    pub(in crate::market) fn view(&mut self, event: Event, equity: Cash) -> (View<'_>, &mut Orders) {
        let view = View {
            event,
            known: &self.known,
            instruments: &self.setup.instruments,
            increments: &self.setup.increments,
            ledger: &self.ledger,
            equity,
            hours: self.timetable.each(),
            halts: self.timetable.halts(),
        };
        (view, &mut self.orders)
    }

    #[inline(always)]
    pub(in crate::market) fn send_asked(&mut self, now: Timestamp, equity: Cash) {
        if !self.orders.requests().is_empty() {
            self.send_all(now, equity);
        }
    }

    /// Takes in what became known, and values what is held by it.
    #[inline(always)]
    fn learn(&mut self, arrival: &Arrival, keep: usize) -> Result<(), MoneyError> {
        let Event { instrument, kind, .. } = arrival.event;
        let (line, known) = (self.feed.line(instrument), &mut self.known[instrument]);
        known.keep = keep;
        let (price, volume) = match kind {
            EventKind::Bar => {
                let Some(bar) = line.bar(arrival.row) else { return Ok(()) };
                known.bars.push(*bar, keep);
                (Some(bar.close), bar.volume)
            }
            EventKind::Quote => {
                let (quotes, place) = line.quotes(arrival.row);
                known.quotes.push(quotes, place, keep);
                // A quote with an empty side has no mid; the last one stands.
                let mid = known.quotes.newest(1).last().and_then(|quote| quote.mid());
                (mid.map(Price::nearest).transpose()?, 0.0)
            }
            EventKind::Trade => {
                let Some(print) = line.print(arrival.row) else { return Ok(()) };
                known.prints.push(*print, keep);
                let marks = self.trades_mark[instrument];
                (if marks { Some(Price::nearest(print.price)?) } else { None }, print.size)
            }
            EventKind::Depth => (known.learn_depth(line, arrival), 0.0),
            EventKind::Timer => (None, 0.0),
        };
        let Some(price) = price else { return Ok(()) };
        if self.clocks.watches() {
            self.clocks.watch(arrival.event.time, price.to_f64());
        }
        self.value(arrival.event, price, volume)
    }

    /// Values what is held by a price that became known, with the volume there was.
    #[inline(always)]
    fn value(&mut self, Event { time, instrument, .. }: Event, price: Price, volume: f64) -> Result<(), MoneyError> {
        self.known[instrument].mark = Some(price);
        self.daily[instrument].see(time, price, volume);
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
        self.equity.push(time, equity);
    }

    /// The strategy learns what became of an order.
    pub(in crate::market) fn deliver(
        &mut self,
        place: usize,
        at: Timestamp,
        strategy: Option<&mut dyn Strategy>,
    ) -> Result<(), BacktestError> {
        let notice = self.note(place)?;
        if let (Some(notice), Some(strategy)) = (notice, strategy) {
            let event = Event { time: at, instrument: notice.instrument, kind: EventKind::Timer };
            self.tell(event, |view, orders| strategy.on_notice(view, &notice, orders))?;
        }
        Ok(())
    }

    /// The strategy is told something that is no event, and may ask for orders.
    pub(in crate::market) fn tell(
        &mut self,
        event: Event,
        hears: impl FnOnce(&View<'_>, &mut Orders),
    ) -> Result<(), BacktestError> {
        let equity = self.hear(event, hears)?;
        self.send_asked(event.time, equity);
        Ok(())
    }

    /// The same, but that what it asks for is not sent yet: the equity it decided on.
    #[inline(always)]
    pub(in crate::market) fn hear(
        &mut self,
        event: Event,
        hears: impl FnOnce(&View<'_>, &mut Orders),
    ) -> Result<Cash, BacktestError> {
        let equity = self.ledger.equity().map_err(|error| self.money(event, error))?;
        let (view, orders) = self.view(event, equity);
        hears(&view, orders);
        Ok(equity)
    }
}
