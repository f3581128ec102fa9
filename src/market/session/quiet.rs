//! Quiet stretches: bars with nothing between them, while no order waits and nothing is on its way.
//!
//! Nearly all of a backtest on bars is that. Nothing happens there but that a bar becomes known and the strategy decides; so
//! what [`Session::step`] looks for at each event is looked for once.

use std::sync::Arc;

use crate::market::feed::BarsAlone;
use crate::market::sources::RowKind;
use crate::market::{BacktestError, Strategy};
use crate::sim2real::Timestamp;

use super::Session;

impl Session {
    /// Lets at least one event happen and about `events` at most, as [`Session::step`] does one by one; whether there are more.
    ///
    /// # Errors
    /// As [`Backtest::run`](crate::market::Backtest::run).
    pub fn advance(&mut self, strategy: &mut dyn Strategy, events: usize) -> Result<bool, BacktestError> {
        let last = self.held.events.saturating_add(events.max(1));
        while self.held.events < last {
            if self.can_be_quiet {
                self.pass_quiet_bars(strategy, last)?;
            }
            if self.step(strategy)?.is_none() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Whether there is nothing in this run that wants to be looked for at every event: delays of data, hours of trading, and
    /// what happens to an account. Without bars there is no such stretch.
    pub(super) fn may_be_quiet(&self) -> bool {
        self.feed.lines().iter().any(|line| line.tells(RowKind::Bars))
            && self.direct
            && self.timetable.is_empty()
            && self.keeping.is_none()
            && !self.clocks.watches()
    }

    /// Shows the strategy the bars of a quiet stretch, up to the first after which something is due.
    #[inline]
    fn pass_quiet_bars(&mut self, strategy: &mut dyn Strategy, last: usize) -> Result<(), BacktestError> {
        let Some(BarsAlone { instrument, bars, next, end: others, .. }) = self.feed.bars_alone() else { return Ok(()) };
        if next.is_empty() {
            return Ok(());
        }
        let floor = &self.venue.floors[instrument];
        if !floor.is_idle() || !floor.is_quiet() {
            return Ok(());
        }
        let bars = Arc::clone(bars);
        let due = self.agenda.peek().map_or(Timestamp::MAX, |(at, _)| at);
        let shown = self.transit.peek().unwrap_or(Timestamp::MAX);
        // What is held is charged at the first event of a day.
        let day = if self.venue.charges.is_empty() { Timestamp::MAX } else { self.carry.next };
        let (end, most) = (others.min(due).min(shown).min(day), last.saturating_sub(self.held.events));
        let (mut passed, mut shown) = (0, Ok(None));
        for bar in bars[next].iter().take(most).take_while(|bar| bar.known_at < end) {
            passed += 1;
            match self.show_bar(instrument, bar, strategy) {
                Ok(None) => {}
                Ok(Some(equity)) => {
                    shown = Ok(Some((bar.known_at, equity)));
                    break;
                }
                Err(error) => {
                    shown = Err(error);
                    break;
                }
            }
        }
        if passed > 0 {
            self.rows += passed;
            self.feed.skip_bars(passed);
        }
        match shown? {
            // Whoever lets it advance looks at it after the last event.
            Some((now, equity)) if self.held.events < last => self.send_on(now, equity, strategy)?,
            Some((now, equity)) => self.send_all(now, equity),
            None => {}
        }
        Ok(())
    }
}
