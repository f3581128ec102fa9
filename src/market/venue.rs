//! Where orders meet the market: one floor an instrument, each an assembly of the plant every order meets.
//!
//! - **Bars**: an order meets the first bar that opens at or after its arrival, at its open and never at a price already seen;
//!   what rests then meets the prices on the way within each bar, in an order that is a stated rule ([`Intrabar`]).
//! - **Displayed prices** (quotes, or the whole book), which go before bars: an order without delay meets what the instant of its
//!   decision leaves, one with a delay what was displayed strictly before its arrival. Where the side it needs is empty, it
//!   waits. A resting order has a place in the queue at its price ([`QueueModel`]); it is filled when trades have used up
//!   what stood ahead of it, or when others show a price at or beyond its own.
//!
//! A replayed history does not react to our orders: what an impact leaves behind is in the mechanisms' memory only. Orders that
//! take pay it, and orders that wait do so in the market as own orders have moved it.

mod auction;
mod bars;
mod by_order;
mod displayed;
mod floor;
mod moved;
mod path;
mod plain;
mod queue;
mod resting;
mod shown;
mod standing;
mod taken;

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::sim2real::{Assembly, Seed, Simulator, Site, Thetas, Timestamp, Twin, law_parameters};

use super::mechanism::charge_kind;
use super::{AnotherFill, Book, ChargeKind, DepthBook, Execution, Increments, Quantity, Side, WhileHalted};

pub use path::Intrabar;
pub use queue::QueueModel;

pub(super) use auction::Auctions;
pub(super) use by_order::Others;
pub(super) use floor::{Floor, Rules};
use moved::Moved;
pub(super) use resting::{Filled, Outcome, Resting, What};

/// The price mechanisms start from where there are quotes. Where there are bars only it is the open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Reference {
    /// Midway between bid and ask.
    Mid,
    /// The best price an order can take.
    Touch,
}

impl Reference {
    /// The reference that suits the mechanisms of `venue`: the mid where one of them adds the spread (`half_spread`,
    /// `book_walk`), else the touch.
    #[must_use]
    pub fn suiting(venue: &Assembly<Execution>) -> Self {
        let adds_spread = venue.modelled().iter().any(|name| matches!(*name, "half_spread" | "book_walk"));
        if adds_spread { Self::Mid } else { Self::Touch }
    }

    /// The price of `book` it stands for, for an order of `side`.
    #[must_use]
    pub fn of(self, book: &Book, side: Side) -> Option<f64> {
        match self {
            Self::Mid => book.mid(),
            Self::Touch => book.touch(side),
        }
    }
}

/// How far the market must go for a resting limit order to be filled, where nothing is known of the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LimitFill {
    /// A tick beyond the limit: then whoever stood ahead was filled too.
    #[default]
    Through,
    /// To the limit: as if nobody stood ahead, which flatters.
    Touch,
}

impl LimitFill {
    /// Its word in reports.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Through => "when the price goes a tick beyond the limit",
            Self::Touch => "when the price reaches the limit",
        }
    }
}

/// How orders are matched, as far as that is no mechanism: `[matching]` of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Matching {
    /// Which extreme of a bar comes first.
    pub intrabar: Intrabar,
    /// How far the market must go for a limit order to be filled.
    pub limit_fill: LimitFill,
    /// How the queue at a price moves.
    pub queue: QueueModel,
    /// What becomes of orders that come in a halt.
    pub halted: WhileHalted,
    /// Whether the data show what the orders of the run did to the market: those that follow then find it there.
    #[serde(skip)]
    pub shows_own_orders: bool,
}

/// The floors of all instruments, and what their laws are called.
#[derive(Clone)]
pub(super) struct Venue {
    pub floors: Vec<Floor>,
    /// Ids of the mechanisms that act on prices, in their order.
    pub conceding: Vec<&'static str>,
    /// What each mechanism that may charge, on fills or on what is held, charges for.
    pub charges: Vec<ChargeKind>,
    /// Which of the parameters each law has.
    of_laws: [Vec<Range<usize>>; 3],
}

/// What a venue is made of beside its mechanisms.
pub(super) struct Setup<'a> {
    pub symbols: Vec<&'a str>,
    pub increments: &'a [Increments],
    /// Of each instrument: whether its data know the whole book, the orders of others one by one, and whether bars are all
    /// there is.
    pub depth: Vec<Detail>,
    pub rules: Rules,
    pub seed: Seed,
}

/// How finely the data of an instrument are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Detail {
    /// Bars alone.
    Bars,
    /// Quotes, or trades.
    Quotes,
    /// The whole book, by price.
    ByPrice,
    /// The whole book, by order.
    ByOrder,
}

impl Venue {
    pub fn new(assembly: &Assembly<Execution>, setup: &Setup<'_>) -> Self {
        let values: Vec<f64> = assembly.parameters().iter().map(|p| p.nominal).collect();
        let thetas = Thetas::single(&values);
        let still = Thetas::single(&[]);
        // Prices of an order that walks the book are averages over several trades, which lie between ticks.
        let averages = assembly.modelled().contains(&"book_walk");
        let asks_queue = assembly.modelled().contains(&"queue_position");
        // In the order in which a run has their laws, which is that of where they act.
        let acting = |site| assembly.mechanisms().filter(move |(row, form, _)| row.site(*form) == site);
        let conceding: Vec<&'static str> = acting(Site::Plant).map(|(row, ..)| row.about().name).collect();
        let charges = acting(Site::Observation).map(|(row, ..)| charge_kind(row.about().name)).collect();
        let lasts = |name: &&str| matches!(*name, "permanent_impact" | "transient_impact");
        let lasting: Vec<usize> = conceding.iter().enumerate().filter(|(_, name)| lasts(name)).map(|(law, _)| law).collect();
        let floor = |(number, symbol): (usize, &&str)| {
            let run = assembly.run(&thetas, &still, setup.seed.child(symbol));
            let increments = setup.increments[number];
            let mut floor = Floor::new(number, increments, averages, conceding.len(), setup.rules, run);
            (floor.asks_queue, floor.moved) = (asks_queue, Moved::by_laws(lasting.clone()));
            match setup.depth[number] {
                Detail::Bars => floor.by_bars = true,
                Detail::Quotes => {}
                detail => {
                    floor.shown = shown::Shown::Depth(Box::new(DepthBook::new(increments)));
                    floor.by_order = detail == Detail::ByOrder;
                }
            }
            floor
        };
        let floors = setup.symbols.iter().enumerate().map(floor).collect();
        Self { floors, conceding, charges, of_laws: law_parameters(assembly) }
    }

    /// Laws have these values of all parameters from now on; what they remember stays.
    pub fn retune(&mut self, values: &[f64]) {
        self.floors.iter_mut().for_each(|floor| floor.run.retune_laws(&self.of_laws, 0, values));
    }
}

impl Floor {
    /// Orders that were sent together arrive.
    pub fn arrive(&mut self, orders: impl Iterator<Item = Resting>, at: Timestamp) {
        let first = self.resting.len();
        self.resting.extend(orders);
        self.displace(at);
        let open = self.is_open();
        if !open || !self.by_bars {
            for k in first..self.resting.len() {
                match self.resting[k].left > Quantity::ZERO {
                    true if open => self.meet_shown(k, at),
                    true => self.wait_for_open(k, at),
                    false => {}
                }
            }
        }
        self.sweep(at);
    }

    /// Before the first message: the book is there already.
    pub fn begin_with_book(&mut self, book: DepthBook, others: Others) {
        self.shown = shown::Shown::Depth(Box::new(book));
        self.others = others;
    }

    /// The next fill of an order is to be another.
    pub fn fill_instead(&mut self, id: super::OrderId, instead: AnotherFill) {
        self.instead.retain(|(other, _)| *other != id);
        self.instead.push((id, instead));
    }

    /// How far bars left open what was filled.
    pub fn ambiguous_bars(&self) -> usize {
        self.ambiguous
    }

    /// Takes what happened since the last time, with what mechanisms added to each fill.
    pub fn drain(&mut self, outcomes: &mut Vec<Outcome>, terms: &mut Vec<f64>) {
        outcomes.append(&mut self.outcomes);
        terms.append(&mut self.terms);
    }

    /// Whether anything happened since the last time.
    #[inline]
    pub fn is_quiet(&self) -> bool {
        self.outcomes.is_empty()
    }

    /// Whether no order waits here.
    #[inline]
    pub fn is_idle(&self) -> bool {
        self.resting.is_empty()
    }

    /// The data have come to a row of a kind: 0 bars, 1 quotes, 2 trades, 3 changes of the book.
    #[inline]
    pub fn at_row(&mut self, kind: usize, row: usize) {
        self.rows[kind] = row;
    }

    /// Whether bars are all there is.
    #[inline]
    pub fn by_bars(&self) -> bool {
        self.by_bars
    }
}
