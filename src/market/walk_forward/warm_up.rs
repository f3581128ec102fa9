//! The past a strategy needs before its first decision.

use crate::market::{History, Orders, Strategy, View};
use crate::sim2real::Timestamp;

use super::Window;

/// A strategy that sees what it is shown from the start, and whose orders count from `from` on.
pub(super) struct Warmed<'a> {
    pub inner: &'a mut dyn Strategy,
    pub from: Timestamp,
}

impl Strategy for Warmed<'_> {
    fn name(&self) -> &str {
        self.inner.name()
    }

    fn lookback(&self) -> usize {
        self.inner.lookback()
    }

    fn on_event(&mut self, view: &View<'_>, orders: &mut Orders) {
        self.inner.on_event(view, orders);
        if view.now() < self.from {
            orders.clear();
        }
    }
}

/// What a test of `window` is shown: its own data, and of each instrument as many bars and quotes before them as complete
/// the first `lookback`. That is the past when the test begins, whatever training left out of it.
pub(super) fn warmed(histories: &[History], window: &Window, lookback: usize) -> Vec<History> {
    let last = Timestamp(window.test_end.0.saturating_sub(1));
    histories.iter().map(|history| history.within(first_shown(history, window.test_start, lookback), last)).collect()
}

fn first_shown(history: &History, start: Timestamp, lookback: usize) -> Timestamp {
    let missing = lookback.saturating_sub(1);
    let bars = history.bars();
    let bar = bars.partition_point(|bar| bar.known_at < start).saturating_sub(missing);
    let times = history.quotes().times();
    let quote = times.partition_point(|time| *time < start).saturating_sub(missing);
    let shown = [bars.get(bar).map(|bar| bar.known_at), times.get(quote).copied()];
    shown.into_iter().flatten().min().map_or(start, |first| first.min(start))
}
