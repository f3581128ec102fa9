//! How a paper log is read: what the commands that read one have in common.

use std::path::PathBuf;

use chrono_tz::Tz;
use clap::Args;

use crate::io::{InputError, did_you_mean, hint_among};
use crate::market::paper::import::{FORMATS, FeeRates, ImportSettings, SymbolMap};

/// What the user adds to a log.
#[derive(Debug, Args)]
pub(super) struct LogArguments {
    /// Format of the log [default: told by its content]
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    /// Names of symbols: a TOML file with a table [symbols], or a table with columns log_symbol and symbol
    #[arg(long, value_name = "MAP")]
    symbols: Option<PathBuf>,
    /// Zone of times that have none, such as America/New_York
    #[arg(long, value_name = "ZONE", value_parser = zone)]
    zone: Option<Tz>,
    /// What one unit of a currency in which fees were taken is worth in that of the price, such as BNB/USDT=612.5; fees
    /// without a rate are kept apart [may be given several times]
    #[arg(long = "fee-rate", value_name = "FROM/TO=RATE")]
    rates: Vec<String>,
}

impl LogArguments {
    /// Refuses what says something of a log, where there is none.
    pub fn check_unused(&self) -> Result<(), InputError> {
        let given = [
            ("--format", self.format.is_some()),
            ("--symbols", self.symbols.is_some()),
            ("--zone", self.zone.is_some()),
            ("--fee-rate", !self.rates.is_empty()),
        ];
        match given.iter().find(|(_, given)| *given) {
            None => Ok(()),
            Some((name, _)) => Err(InputError::new(*name, "says how a log is read, and means nothing to a tape")
                .hint("leave it out: what a tape is, its columns say")),
        }
    }

    pub fn settings(&self) -> Result<ImportSettings, InputError> {
        let mut rates = FeeRates::default();
        for rate in &self.rates {
            rates.add(rate).map_err(|error| {
                let text = error.to_string();
                let (message, hint) = text.split_once("\nhint: ").unwrap_or((&text, ""));
                InputError::new("--fee-rate", message).hint(hint)
            })?;
        }
        if let Some(format) = self.format.as_ref().filter(|id| FORMATS.iter().all(|format| format.id != **id)) {
            let ids = FORMATS.map(|format| format.id);
            let error = InputError::new("--format", "there is no such format").found_text(format);
            return Err(error.maybe_hint(hint_among(format, &ids)));
        }
        Ok(ImportSettings {
            format: self.format.clone(),
            symbols: self.symbols.as_deref().map(SymbolMap::read).transpose()?.unwrap_or_default(),
            zone: self.zone,
            rates,
        })
    }
}

/// A zone by its name in the IANA database.
fn zone(text: &str) -> Result<Tz, String> {
    text.parse().map_err(|_| {
        let meant = did_you_mean(text, chrono_tz::TZ_VARIANTS.iter().map(|zone| zone.name()));
        let hint = meant.map_or_else(|| "such as America/New_York".to_owned(), |meant| format!("did you mean {meant}?"));
        format!("there is no such zone\n  hint: {hint}")
    })
}
