//! One record of a log under the eyes of a reader: cells as exact numbers and times, and what was odd about them.

use super::super::{Charge, FindingKind, Liquidity, PaperFill, PaperFinding, PaperOrder, SourcePlace};
use super::settings::worth;
use super::stamp::{NoTime, Written, stamp};
use super::{ImportSettings, Stop};
use crate::io::{InputError, Place, Record};
use crate::market::{Cash, DecimalError, Price, Quantity, Rounded, Side};
use crate::sim2real::Timestamp;

/// A record, and what was found in it so far.
pub(super) struct Row<'a> {
    record: Record<'a>,
    table: &'a str,
    settings: &'a ImportSettings,
    pub found: Vec<PaperFinding>,
}

impl<'a> Row<'a> {
    pub fn new(record: Record<'a>, table: &'a str, settings: &'a ImportSettings) -> Self {
        Self { record, table, settings, found: Vec::new() }
    }

    /// The text of a cell; none where it is empty.
    pub fn text(&self, key: &str) -> Option<&'a str> {
        self.record.get(key)
    }

    /// The text of the first of `keys` that the record has.
    pub fn text_of(&self, keys: &[&str]) -> Option<&'a str> {
        keys.iter().find_map(|key| self.record.get(key))
    }

    /// The text of a cell that must have one.
    pub fn need(&self, key: &str) -> Result<&'a str, Stop> {
        self.text(key).ok_or_else(|| self.unread(key, "expected a value, the cell is empty"))
    }

    pub fn owned(&self, key: &str) -> Option<String> {
        self.text(key).map(str::to_owned)
    }

    /// Whether the row is of a table of a database.
    pub fn is_of_database(&self) -> bool {
        self.record.records().table().is_some()
    }

    /// Whether the table has that key, also where this row has no value for it.
    pub fn has_key(&self, key: &str) -> bool {
        self.record.records().has(key)
    }

    /// Number of the row in its table, from 1.
    pub fn number(&self) -> usize {
        self.record.row()
    }

    pub fn place(&self) -> SourcePlace {
        SourcePlace { table: self.table.to_owned(), row: Some(self.record.row()), column: None }
    }

    fn place_of(&self, key: &str) -> SourcePlace {
        SourcePlace { column: Some(key.to_owned()), ..self.place() }
    }

    /// The error of a row that cannot be read for the cell `key`.
    pub fn unread(&self, key: &str, message: impl Into<String>) -> Stop {
        let finding = PaperFinding::at(FindingKind::UnreadRow, self.place_of(key), message);
        Stop::Row(Box::new(match self.text(key) {
            Some(text) => finding.found(text),
            None => finding,
        }))
    }

    /// Notes something about the row.
    pub fn note(&mut self, kind: FindingKind, message: impl Into<String>) {
        self.found.push(PaperFinding::at(kind, self.place(), message));
    }

    /// Notes something about a cell.
    pub fn note_cell(&mut self, kind: FindingKind, key: &str, message: impl Into<String>) {
        let finding = PaperFinding::at(kind, self.place_of(key), message);
        self.found.push(match self.text(key) {
            Some(text) => finding.found(text),
            None => finding,
        });
    }

    /// A number in units of `read`; a note where digits were rounded off.
    fn number_of<T>(
        &mut self,
        key: &str,
        text: &str,
        read: impl Fn(&str) -> Result<Rounded<T>, DecimalError>,
    ) -> Result<T, Stop> {
        let number = read(text).map_err(|error| {
            let message = error.to_string();
            self.unread(key, message.lines().next().unwrap_or_default())
        })?;
        if number.rounded {
            self.note_cell(FindingKind::RoundedNumber, key, "digits below the smallest unit are rounded off");
        }
        Ok(number.value)
    }

    /// A price; none where the cell is empty.
    pub fn price(&mut self, key: &str) -> Result<Option<Price>, Stop> {
        self.text(key).map(|text| self.number_of(key, text, Price::nearest_decimal)).transpose()
    }

    /// A price; none where the cell is empty or 0, by which many logs say that there is none.
    pub fn price_above_zero(&mut self, key: &str) -> Result<Option<Price>, Stop> {
        Ok(self.price(key)?.filter(|price| price.0 != 0))
    }

    /// A price that must be there; those of spreads and of some commodities are negative.
    pub fn need_price(&mut self, key: &str) -> Result<Price, Stop> {
        let text = self.need(key)?;
        self.number_of(key, text, Price::nearest_decimal)
    }

    /// A quantity; none where the cell is empty.
    pub fn quantity(&mut self, key: &str) -> Result<Option<Quantity>, Stop> {
        self.text(key).map(|text| self.number_of(key, text, Quantity::nearest_decimal)).transpose()
    }

    /// A quantity above 0 that must be there.
    pub fn need_quantity(&mut self, key: &str) -> Result<Quantity, Stop> {
        let text = self.need(key)?;
        let quantity = self.number_of(key, text, Quantity::nearest_decimal)?;
        if quantity.0 <= 0 {
            return Err(self.unread(key, "expected a quantity above 0"));
        }
        Ok(quantity)
    }

    /// An amount of cash; none where the cell is empty.
    pub fn cash(&mut self, key: &str) -> Result<Option<Cash>, Stop> {
        self.text(key).map(|text| self.number_of(key, text, Cash::nearest_decimal)).transpose()
    }

    /// A time; none where the cell is empty.
    pub fn time(&mut self, key: &str, written: Written) -> Result<Option<Timestamp>, Stop> {
        let Some(text) = self.text(key) else { return Ok(None) };
        match stamp(text, written, self.settings.zone) {
            Ok(stamp) => {
                if stamp.twice {
                    self.note_cell(FindingKind::DoubleHour, key, "the clocks pass this time twice; the earlier is taken");
                }
                if stamp.own_zone && written == Written::Digits && self.settings.zone.is_some() {
                    self.note_cell(FindingKind::MixedZones, key, "the time has a zone of its own, which counts");
                }
                Ok(Some(stamp.at))
            }
            Err(NoTime::Unreadable(message)) => Err(self.unread(key, message)),
            Err(NoTime::NoZone) => Err(Stop::File(
                InputError::new(self.record.records().path(), "the time has no zone, and none is given")
                    .at(Place::Row(self.record.row()))
                    .in_column(key)
                    .found_text(text)
                    .hint("say the zone in which the log was written, such as --zone America/New_York"),
            )),
        }
    }

    /// A time that must be there.
    pub fn need_time(&mut self, key: &str, written: Written) -> Result<Timestamp, Stop> {
        self.need(key)?;
        self.time(key, written)?.ok_or_else(|| self.unread(key, "expected a time"))
    }

    /// The first time there is among `keys`.
    pub fn time_of(&mut self, keys: &[&str], written: Written) -> Result<Option<Timestamp>, Stop> {
        match keys.iter().find(|key| self.text(key).is_some()) {
            Some(key) => self.time(key, written),
            None => Ok(None),
        }
    }

    /// A side that must be there.
    pub fn need_side(&self, key: &str) -> Result<Side, Stop> {
        side_of(self.need(key)?).ok_or_else(|| self.unread(key, "expected a side, buy or sell"))
    }

    /// A role, where the cell has one.
    pub fn liquidity(&self, key: &str) -> Option<Liquidity> {
        self.text(key).and_then(Liquidity::of_word)
    }

    /// Adds a fee to a fill: as it was charged, and in the currency of the price where that can be said. `base` is what was
    /// bought or sold, where it is a currency.
    pub fn charge(&mut self, fill: &mut PaperFill, amount: Cash, currency: Option<&str>, base: Option<&str>) {
        let same = |other: Option<&str>| currency.zip(other).is_some_and(|(a, b)| a.eq_ignore_ascii_case(b));
        fill.fee = match (currency, fill.currency.as_deref()) {
            _ if amount == Cash::ZERO => Some(amount),
            (None, _) => Some(amount),
            (Some(_), of_price) if same(of_price) => Some(amount),
            (Some(_), _) if same(base) => {
                self.note(
                    FindingKind::FeeInBase,
                    "the fee was taken in what was traded; it counts at the price of the fill",
                );
                worth(amount, fill.price)
            }
            (Some(paid), of_price) => {
                let converted = of_price.and_then(|to| self.settings.rates.convert(amount, paid, to));
                let of_price = of_price.unwrap_or("the currency of the price, which the log does not say,");
                match converted {
                    Some(_) => self.note(FindingKind::FeeConverted, format!("{amount} {paid} into {of_price}")),
                    None => self.note(
                        FindingKind::FeeInOtherCurrency,
                        format!("{amount} {paid} beside a price in {of_price}: a rate ({paid}/... with --fee-rate) would count it"),
                    ),
                }
                converted
            }
        };
        fill.charged = Some(Charge { amount, currency: currency.map(str::to_owned) });
    }

    /// Whether a cell says true.
    pub fn is_true(&self, key: &str) -> bool {
        self.text(key).is_some_and(|text| text.eq_ignore_ascii_case("true") || text == "1")
    }

    /// Reads a record that stands within this one, under `key`. One that cannot be read is a finding, and the row stays.
    pub fn within<T>(
        &mut self,
        inner: Record<'_>,
        key: &str,
        read: impl FnOnce(&mut Row<'_>) -> Result<T, Stop>,
    ) -> Result<Option<T>, Stop> {
        let table = format!("{}: row {}, column `{key}`", self.table, self.record.row());
        let mut row = Row::new(inner, &table, self.settings);
        match read(&mut row) {
            Ok(value) => {
                self.found.append(&mut row.found);
                Ok(Some(value))
            }
            Err(Stop::Row(finding)) => {
                self.found.push(*finding);
                Ok(None)
            }
            Err(stop) => Err(stop),
        }
    }

    /// An order of this row.
    pub fn order(&self, id: &str, symbol: &str, side: Side) -> PaperOrder {
        PaperOrder::new(id, symbol, side, self.place())
    }
}

/// The side a word stands for: buy or sell, with whatever is said behind it.
pub(super) fn side_of(word: &str) -> Option<Side> {
    let word = word.trim().to_lowercase();
    let begins = |with: &[&str]| with.iter().any(|start| word == *start || word.starts_with(&format!("{start}_")));
    match () {
        () if begins(&["buy", "b", "bot", "bought", "long"]) => Some(Side::Buy),
        () if begins(&["sell", "s", "sld", "sold", "short"]) => Some(Side::Sell),
        () => None,
    }
}
