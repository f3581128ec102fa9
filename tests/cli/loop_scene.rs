//! Two days of a generated market, a strategy that was tried on them with nothing between decision and fill, and the same strategy
//! on paper, where there is.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fmt::Write as _;

/// The first instants of the days [s].
pub const DAYS: [i64; 2] = [1_709_649_000, 1_709_735_400];

/// Between them.
pub const NIGHT: &str = "2024-03-06T00:00:00Z";

/// What is there on paper, and not in the backtest.
pub const PHYSICS: &str = "\n[[mechanism]]\nname = \"command_delay\"\nseconds = 1.0\n\n\
    [[mechanism]]\nname = \"half_spread\"\nfraction = 1.0\n\n\
    [[mechanism]]\nname = \"book_walk\"\nfraction = 1.0\n\n[[mechanism]]\nname = \"commission\"\nbps = 0.8\n";

/// What the strategy was tried with: fills at the touch.
pub const RUN: &str = r#"# What the strategy was tried with.
[run]
seed = 7
cash = 1_000_000
currency = "USD"   # as the account

[[instrument]]
symbol = "XYZ"
tick_size = 0.01
average_daily_volume = 500_000
daily_volatility = 0.009

[[data]]
symbol = "XYZ"
quotes = "quotes.csv"

[[data]]
symbol = "XYZ"
bars = "bars.csv"
stamp = "open"
interval = "5s"

[strategy]
kind = "sma_cross"
fast = 3
slow = 9
weight = 0.02
"#;

/// The run with `more` keys in `[run]`.
pub fn run_with(more: &str) -> String {
    let currency = "currency = \"USD\"   # as the account\n";
    RUN.replace(currency, &format!("{currency}{more}\n"))
}

/// The run on the first day, or on the second.
pub fn first() -> String {
    run_with(&format!("end = \"{NIGHT}\""))
}

/// As [`first`].
pub fn second() -> String {
    run_with(&format!("start = \"{NIGHT}\""))
}

/// A market of four quotes a second.
pub struct Market {
    /// `quotes.csv`, three levels deep.
    pub quotes: String,
    /// `bars.csv`, of five seconds.
    pub bars: String,
}

impl Market {
    /// Two days of `rows` quotes each.
    pub fn new(rows: i64, seed: u64) -> Self {
        let head = "ts,bid,bid_size,ask,ask_size,bid2,bid2_size,ask2,ask2_size,bid3,bid3_size,ask3,ask3_size\n";
        let mut market = Self { quotes: head.to_owned(), bars: "ts,open,high,low,close,volume\n".to_owned() };
        let mut draws = Draws(seed);
        let mut mid = 10_000;
        for start in DAYS {
            mid = market.day(start, rows, mid, &mut draws);
        }
        market
    }

    /// A day that begins at a mid of `mid` ticks; gives the last.
    fn day(&mut self, start: i64, rows: i64, mut mid: i64, draws: &mut Draws) -> i64 {
        const IN_A_BAR: i64 = 20;
        let mut bar = [mid; 4];
        for k in 0..rows {
            mid += [-1, 0, 0, 0, 1][draws.below(5)];
            if k % IN_A_BAR == 0 {
                bar = [mid; 4];
            }
            bar = [bar[0], bar[1].max(mid), bar[2].min(mid), mid];
            let (bid, ask) = (mid - [1, 1, 2][draws.below(3)], mid + [1, 1, 2, 4][draws.below(4)]);
            // Bars end between two quotes.
            let _ = write!(self.quotes, "{}", start * 1_000_000_000 + k * 250_000_000 + 100_000_000);
            for (beyond, many) in [(0, 1), (2, 1), (4, 4)] {
                for price in [bid - beyond, ask + beyond] {
                    let size = (20 + draws.below(100)) * many;
                    let _ = write!(self.quotes, ",{}.{:02},{size}", price / 100, price % 100);
                }
            }
            self.quotes.push('\n');
            if k % IN_A_BAR == IN_A_BAR - 1 {
                let _ = write!(self.bars, "{}000000000", start + k / IN_A_BAR * 5);
                for price in bar {
                    let _ = write!(self.bars, ",{}.{:02}", price / 100, price % 100);
                }
                self.bars.push_str(",1000\n");
            }
        }
        mid
    }
}

/// Numbers that only have to look drawn: Knuth's linear congruential generator (MMIX).
struct Draws(u64);

impl Draws {
    fn below(&mut self, count: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % count as u64) as usize
    }
}
