//! The files of a tape: what each of them is, and how orders are made of them.

use std::path::{Path, PathBuf};

use crate::io::{ClockOffset, FeedFormat, InputError, Layout, OnBad, Renames, TableChunks, listed, record_files};
use crate::market::{Book, FileStream, Finding, OrderStep, Stream};

use super::book::TapeBook;
use super::by_order::ByOrder;
use super::by_trade::ByTrade;
use super::found::{TapeCounts, TapeSink};
use super::shown::{Rows, Shown, of_stream};

/// What a file of a tape holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Content {
    /// Every order, event by event.
    Orders,
    Trades,
    /// Changes of a book, price by price.
    Depth,
    /// The book from which on such changes count.
    Snapshot,
    Quotes,
}

/// A kind of file by the columns that it has and no other kind has all of.
struct Kind {
    columns: &'static [&'static str],
    content: Content,
    layout: Layout,
}

const fn kind(columns: &'static [&'static str], content: Content, layout: Layout) -> Kind {
    Kind { columns, content, layout }
}

/// The kinds; of several that fit, the first is meant.
static KINDS: [Kind; 9] = [
    kind(&["id", "timestamp", "exchange.timestamp", "action", "direction"], Content::Orders, Layout::BitstampL3),
    kind(&["ts", "order_id", "action", "side", "price", "size"], Content::Orders, Layout::TrueupOrders),
    kind(&["trade_id", "price", "qty", "buyer_is_maker"], Content::Trades, Layout::BinanceTrades),
    kind(&["last_update_id", "prev_update_id", "side", "price", "qty"], Content::Depth, Layout::BinanceDepth),
    kind(&["last_update_id", "side", "price", "qty"], Content::Snapshot, Layout::BinanceDepth),
    kind(&["bid_px", "bid_sz", "ask_px", "ask_sz"], Content::Quotes, Layout::BinanceBookTicker),
    kind(&["ts", "bid", "bid_size", "ask", "ask_size"], Content::Quotes, Layout::Trueup),
    kind(&["ts", "side", "price", "size"], Content::Depth, Layout::Trueup),
    kind(&["ts", "price", "size"], Content::Trades, Layout::Trueup),
];

/// The files of one tape.
#[derive(Debug, Clone, PartialEq)]
pub struct TapeSources {
    orders: Option<Source>,
    trades: Option<Source>,
    depth: Option<Source>,
    quotes: Option<Source>,
}

#[derive(Debug, Clone, PartialEq)]
struct Source {
    path: PathBuf,
    format: FeedFormat,
}

/// How a tape is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TapeSettings {
    /// Levels a side that are told of the book, from 1 to [`Book::DEPTH`].
    pub levels: usize,
    /// Of trades beside a book: how long after a trade an order must come so that the feed has told what that one left [ns].
    pub apart: i64,
}

impl TapeSettings {
    /// The distance where nothing else is asked for [ns]: the 50 ms at which Binance tells of the levels behind the touch. What an
    /// earlier order left of these is not known sooner.
    pub const APART: i64 = 50_000_000;
}

impl Default for TapeSettings {
    fn default() -> Self {
        Self { levels: Book::DEPTH, apart: Self::APART }
    }
}

/// What came of reading a tape.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TapeReading {
    /// Counts.
    pub counts: TapeCounts,
    /// What was found in the files, a sentence each.
    pub notes: Vec<String>,
}

impl TapeSources {
    /// Finds out what the files are, by their columns: one file of orders, event by event; or one of trades beside changes of a
    /// book (with their snapshot), quotes, or both. Of a folder all tables are taken.
    ///
    /// # Errors
    /// A file that cannot be read or is none of these; two of a kind; files that make no tape together.
    pub fn find(paths: &[PathBuf]) -> Result<Self, InputError> {
        let mut files = Vec::new();
        for path in paths {
            if path.is_dir() { files.extend(record_files(path)?) } else { files.push(path.clone()) }
        }
        let mut found = Self { orders: None, trades: None, depth: None, quotes: None };
        let mut snapshot = None;
        for path in &files {
            let (content, layout) = content(path)?;
            let mut format = FeedFormat::of_layout(layout);
            format.rules.on_bad = OnBad::Drop;
            if layout.has_local_clock() {
                format.clock.offset = ClockOffset::Estimated;
            }
            let source = Source { path: path.clone(), format };
            let (place, what) = match content {
                Content::Orders => (&mut found.orders, "orders"),
                Content::Trades => (&mut found.trades, "trades"),
                Content::Depth => (&mut found.depth, "changes of a book"),
                Content::Snapshot => (&mut snapshot, "a snapshot"),
                Content::Quotes => (&mut found.quotes, "quotes"),
            };
            if let Some(first) = place.replace(source) {
                let message = format!("holds {what}, and so does {}", first.path.display());
                return Err(InputError::new(path, message).hint("give one file of a kind: a tape is of one instrument"));
            }
        }
        match (snapshot, &mut found.depth) {
            (Some(snapshot), Some(depth)) => depth.format.snapshot = Some(snapshot.path),
            (Some(snapshot), None) => {
                let message = "is a snapshot of a book without the changes that go on from it";
                return Err(InputError::new(snapshot.path, message).hint("give the file of changes too"));
            }
            (None, _) => {}
        }
        let place = files.first().map_or(Path::new("."), PathBuf::as_path);
        found.check(place)?;
        Ok(found)
    }

    fn check(&self, place: &Path) -> Result<(), InputError> {
        let beside = [&self.trades, &self.depth, &self.quotes].into_iter().flatten().next();
        match (&self.orders, &self.trades) {
            (Some(_), _) => match beside {
                None => Ok(()),
                Some(other) => Err(InputError::new(&other.path, "is given beside order-by-order events, which say it all")
                    .hint("give the file of orders alone")),
            },
            (None, Some(trades)) if self.depth.is_none() && self.quotes.is_none() => {
                Err(InputError::new(&trades.path, "holds trades, and nothing says which book they met")
                    .hint("give changes of the book with their snapshot, or quotes, beside the trades"))
            }
            (None, Some(_)) => Ok(()),
            (None, None) => Err(InputError::new(place, "there are neither orders nor trades: nobody took anything")
                .hint("give order-by-order events, or trades beside a book")),
        }
    }

    /// The name of the first file without its ending, for an instrument that has no other.
    #[must_use]
    pub fn stem(&self) -> String {
        let name = self.place().file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.split('.').next().unwrap_or_default().to_owned()
    }

    /// The file of orders or trades.
    #[must_use]
    pub fn place(&self) -> &Path {
        self.orders.as_ref().or(self.trades.as_ref()).map_or(Path::new("."), |source| &source.path)
    }

    /// What the tape is, in words.
    #[must_use]
    pub fn what(&self) -> &'static str {
        match (&self.orders, &self.depth, &self.quotes) {
            (Some(_), ..) => "order-by-order events",
            (None, Some(_), Some(_)) => "trades beside a book and the best of it",
            (None, Some(_), None) => "trades beside a book",
            (None, None, _) => "trades beside quotes",
        }
    }

    /// Reads the tape into `sink`: some rows at a time, so that what is in memory does not grow with
    /// the files.
    ///
    /// Rows that cannot be are left out and counted. The book that an order met is that of all rows with an earlier stamp: what
    /// has the order's own stamp may be its doing.
    ///
    /// # Errors
    /// Files that cannot be read, and whatever `sink` refuses.
    pub fn read<S: TapeSink<Error: From<InputError>>>(
        &self,
        settings: TapeSettings,
        sink: &mut S,
    ) -> Result<TapeReading, S::Error> {
        let levels = settings.levels.clamp(1, Book::DEPTH);
        match (&self.orders, &self.trades) {
            (Some(orders), _) => read_orders(orders, levels, sink),
            (None, Some(trades)) => self.read_trades(trades, TapeSettings { levels, ..settings }, sink),
            (None, None) => Ok(TapeReading::default()),
        }
    }

    fn read_trades<S: TapeSink<Error: From<InputError>>>(
        &self,
        trades: &Source,
        TapeSettings { levels, apart }: TapeSettings,
        sink: &mut S,
    ) -> Result<TapeReading, S::Error> {
        let mut counts = TapeCounts::default();
        let mut trades =
            Rows::new(FileStream::numbered_trades(&trades.path, &trades.format, TableChunks::ROWS)?, &trades.path);
        let depth = |source: &Source| {
            Ok::<_, InputError>(Rows::new(FileStream::depth(&source.path, &source.format, TableChunks::ROWS)?, &source.path))
        };
        let quotes = |source: &Source| {
            let stream = FileStream::quotes(&source.path, &source.format, None, TableChunks::ROWS)?;
            Ok::<_, InputError>(Rows::new(stream, &source.path))
        };
        let mut shown = Shown {
            book: TapeBook::default(),
            depth: self.depth.as_ref().map(depth).transpose()?,
            quotes: self.quotes.as_ref().map(quotes).transpose()?,
            begun: self.depth.is_none(),
        };
        let mut found = ByTrade::new(apart);
        let mut taken = Vec::new();
        while let Some(trade_at) = trades.next_time()? {
            while let Some(at) = shown.next_time()?.filter(|at| *at < trade_at) {
                shown.take_instant(at)?;
                shown.tell(at, levels, &mut counts, sink)?;
            }
            while trades.next_time()? == Some(trade_at) {
                let Some(mut trade) = trades.next() else { break };
                // Stamps never go back, so that runs of one stamp are what they are.
                trade.print.what.time = trade_at;
                found.trade(&trade, &shown.book, &mut counts, sink)?;
                taken.push(trade.print.what);
            }
            // What has the stamp of the trades comes after them: no order of that stamp has met it.
            taken.drain(..).for_each(|print| shown.deplete(&print));
            if shown.next_time()? == Some(trade_at) {
                shown.take_instant(trade_at)?;
            }
            shown.tell(trade_at, levels, &mut counts, sink)?;
        }
        found.end_run(&mut counts, sink)?;
        while let Some(at) = shown.next_time()? {
            shown.take_instant(at)?;
            shown.tell(at, levels, &mut counts, sink)?;
        }
        let mut notes = trades.lines();
        notes.extend(shown.depth.iter().flat_map(Rows::lines));
        notes.extend(shown.quotes.iter().flat_map(Rows::lines));
        Ok(TapeReading { counts, notes })
    }
}

fn read_orders<S: TapeSink<Error: From<InputError>>>(
    source: &Source,
    levels: usize,
    sink: &mut S,
) -> Result<TapeReading, S::Error> {
    let mut stream: FileStream<OrderStep> = FileStream::order_steps(&source.path, &source.format, TableChunks::ROWS)?;
    let (mut found, mut counts, mut rows) = (ByOrder::new(levels), TapeCounts::default(), Vec::new());
    while stream.refill(&mut rows).map_err(|error| of_stream(error, &source.path))? {
        for step in rows.drain(..) {
            found.step(step, &mut counts, sink)?;
        }
    }
    found.finish(&mut counts, sink)?;
    let mut notes = stream.notes().lines();
    if stream.notes().count(Finding::UnknownOrder) > 0 {
        notes.push(
            "the book is built from nothing: of orders placed before the file begins only their leaving is told".into(),
        );
    }
    Ok(TapeReading { counts, notes })
}

/// What a file holds, by its columns.
fn content(path: &Path) -> Result<(Content, Layout), InputError> {
    let chunks = TableChunks::open(path, &Renames::new(), TableChunks::ROWS)?;
    let Some(table) = chunks.first() else {
        return Err(InputError::new(path, "has no rows").hint("a tape needs rows: was the file cut off?"));
    };
    let fits = |kind: &&Kind| kind.columns.iter().all(|column| table.has(column));
    KINDS.iter().find(fits).map(|kind| (kind.content, kind.layout)).ok_or_else(|| {
        let kinds: Vec<String> = KINDS.iter().map(|kind| format!("({})", kind.columns.join(", "))).collect();
        let message = format!("its columns ({}) are those of no tape", table.names().join(", "));
        InputError::new(path, message).hint(format!("a tape has one of these sets: {}", listed(&kinds)))
    })
}
