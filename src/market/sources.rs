//! What the data of one instrument are: which kinds of rows there are, and the streams they may come from.

use std::fmt;

#[cfg(feature = "io")]
use super::stream::{Dated, ReadAhead};
use super::stream::{Known, Stream};
use super::{Bar, Book, DataNotes, DepthChange, EventKind, OrderEvent, Print};

/// The kinds of rows a market tells, in the order in which they come at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowKind {
    Bars,
    Trades,
    Depth,
    Orders,
    Quotes,
}

impl RowKind {
    pub const COUNT: usize = 5;
    pub const ALL: [Self; Self::COUNT] = [Self::Bars, Self::Trades, Self::Depth, Self::Orders, Self::Quotes];

    /// What a row of it is to a strategy.
    pub fn event(self) -> EventKind {
        match self {
            Self::Bars => EventKind::Bar,
            Self::Trades => EventKind::Trade,
            Self::Depth | Self::Orders => EventKind::Depth,
            Self::Quotes => EventKind::Quote,
        }
    }
}

/// Streams of the data of one instrument: what a backtest runs on that does not hold them in memory.
#[derive(Default)]
pub struct Sources {
    /// Bars.
    pub bars: Option<Box<dyn Stream<Bar>>>,
    /// Quotes.
    pub quotes: Option<Box<dyn Stream<Known<Book>>>>,
    /// Trades.
    pub trades: Option<Box<dyn Stream<Known<Print>>>>,
    /// Changes of the book, price by price.
    pub depth: Option<Box<dyn Stream<DepthChange>>>,
    /// Events of resting orders.
    pub order_events: Option<Box<dyn Stream<OrderEvent>>>,
}

impl fmt::Debug for Sources {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bars, quotes, trades, depth, order_events } = self;
        let there =
            [bars.is_some(), quotes.is_some(), trades.is_some(), depth.is_some(), order_events.is_some()].map(usize::from);
        write!(f, "Sources({} streams)", there.iter().sum::<usize>())
    }
}

impl Sources {
    pub(super) fn has(&self, kind: RowKind) -> bool {
        match kind {
            RowKind::Bars => self.bars.is_some(),
            RowKind::Trades => self.trades.is_some(),
            RowKind::Depth => self.depth.is_some(),
            RowKind::Orders => self.order_events.is_some(),
            RowKind::Quotes => self.quotes.is_some(),
        }
    }

    /// Each stream is read by a thread of its own from now on, ahead of whoever asks.
    #[cfg(feature = "io")]
    pub(super) fn read_ahead(&mut self) -> std::io::Result<()> {
        fn ahead<T: Dated + Send + 'static>(stream: &mut Option<Box<dyn Stream<T>>>) -> std::io::Result<()> {
            if let Some(own) = stream.take() {
                *stream = Some(Box::new(ReadAhead::new(own)?));
            }
            Ok(())
        }
        let Self { bars, quotes, trades, depth, order_events } = self;
        ahead(bars)?;
        ahead(quotes)?;
        ahead(trades)?;
        ahead(depth)?;
        ahead(order_events)
    }

    pub(super) fn notes(&self) -> Vec<DataNotes> {
        let Self { bars, quotes, trades, depth, order_events } = self;
        let all = [
            bars.as_ref().and_then(|s| s.notes()),
            quotes.as_ref().and_then(|s| s.notes()),
            trades.as_ref().and_then(|s| s.notes()),
            depth.as_ref().and_then(|s| s.notes()),
            order_events.as_ref().and_then(|s| s.notes()),
        ];
        all.into_iter().flatten().cloned().collect()
    }
}
