//! What is traded.

/// An instrument, as twins and runs declare it.
#[derive(Debug, Clone, PartialEq)]
pub struct Instrument {
    /// Symbol.
    pub symbol: String,
    /// Smallest step of the price [currency].
    pub tick_size: f64,
    /// Smallest step of the quantity [units].
    pub lot_size: f64,
    /// Units traded on an average day, where known.
    pub average_daily_volume: Option<f64>,
    /// Standard deviation of the daily return (a fraction), where known.
    pub daily_volatility: Option<f64>,
}

#[cfg(feature = "io")]
impl From<&crate::io::InstrumentEntry> for Instrument {
    fn from(entry: &crate::io::InstrumentEntry) -> Self {
        Self {
            symbol: entry.symbol.clone(),
            tick_size: entry.tick_size,
            lot_size: entry.lot_size,
            average_daily_volume: entry.average_daily_volume,
            daily_volatility: entry.daily_volatility,
        }
    }
}
