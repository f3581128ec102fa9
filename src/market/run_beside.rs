//! What a run reads beside market data: calendars, halts, rates of currencies, dividends and splits.

use crate::io::{FeedKind, InputError, RateSource, RunFile, file_hash};

use super::account_file::AccountFiles;
use super::run_calendar::ReadCalendars;
use super::run_halts::ReadHalts;
use super::run_log::InputFile;

/// What was read, once for all variants of a run.
#[derive(Debug, Clone, Default)]
pub(super) struct Beside {
    pub calendars: ReadCalendars,
    pub account: AccountFiles,
    pub halts: ReadHalts,
    /// Rows of each `[[data]]` that is no market data.
    rows: Vec<Option<usize>>,
}

impl Beside {
    /// Reads what `run` names.
    ///
    /// # Errors
    /// Files that cannot be read or hold what cannot be; calendars there are none of.
    pub fn read(run: &RunFile) -> Result<Self, InputError> {
        let mut calendars = ReadCalendars::default();
        calendars.of(run)?;
        let halts = ReadHalts::read(run)?;
        let mut account = AccountFiles::read_rates(run)?;
        let rows = run.data.iter().map(|entry| match entry.kind {
            FeedKind::Actions => account.read_actions(run, entry).map(Some),
            _ => Ok(None),
        });
        let rows = rows.collect::<Result<_, _>>()?;
        Ok(Self { calendars, account, halts, rows })
    }

    /// All files `run` depends on but its document: calendars, data, rates, halts.
    ///
    /// # Errors
    /// A file that cannot be read any more.
    pub fn inputs(&self, run: &RunFile) -> Result<Vec<InputFile>, InputError> {
        self.inputs_with(run, |_| true)
    }

    /// The same [`inputs`](Self::inputs) with the rows of market data, one for each `[[data]]`.
    pub fn with_rows(&self, mut inputs: Vec<InputFile>, rows: &[Option<usize>]) -> Vec<InputFile> {
        for (file, rows) in inputs.iter_mut().skip(self.calendars.files.len()).zip(rows) {
            file.rows = file.rows.or(*rows);
        }
        inputs
    }

    /// The same without market data, whose rows come from elsewhere.
    ///
    /// # Errors
    /// A file that cannot be read any more.
    pub fn inputs_without_market(&self, run: &RunFile) -> Result<Vec<InputFile>, InputError> {
        self.inputs_with(run, |kind| kind == FeedKind::Actions)
    }

    fn inputs_with(&self, run: &RunFile, with: impl Fn(FeedKind) -> bool) -> Result<Vec<InputFile>, InputError> {
        let mut inputs = self.calendars.files.clone();
        for (number, entry) in run.data.iter().enumerate().filter(|(_, entry)| with(entry.kind)) {
            let rows = self.rows.get(number).copied().flatten();
            inputs.push(InputFile { path: entry.named.clone(), sha256: file_hash(&entry.path)?, rows });
        }
        for (number, rate) in run.rates.iter().enumerate() {
            if let RateSource::File { path, named, .. } = &rate.source {
                let rows = self.account.rows_of_rate(number);
                inputs.push(InputFile { path: named.clone(), sha256: file_hash(path)?, rows });
            }
        }
        inputs.extend(self.halts.files.iter().cloned());
        if let (Some(named), Some(twin)) = (&run.execution.twin, &run.twin) {
            inputs.push(InputFile { path: named.clone(), sha256: file_hash(twin.document().path())?, rows: None });
        }
        Ok(inputs)
    }
}
