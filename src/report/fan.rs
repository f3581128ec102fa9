//! Many runs of one thing over time, as bands.

use super::data_time::{Cut, DataTime};

/// A fan chart: the median of many draws, the bands that hold parts of them, and what they are held against.
///
/// Source: fan charts as the Bank of England's Inflation Report has had them since February 1996 (Britton, Fisher and Whitley,
/// "The Inflation Report projections: understanding the fan chart", 1998).
#[derive(Debug, Clone, PartialEq)]
pub struct Fan {
    /// What it is of, in a few words.
    pub caption: String,
    /// Of what the y axis is, and its unit.
    pub quantity: (String, String),
    /// Times of the curves.
    pub time: FanTime,
    /// Half of all draws lie below.
    pub median: Vec<f64>,
    /// Bands, the narrowest first.
    pub bands: Vec<FanBand>,
    /// What is without any draw.
    pub nominal: Vec<f64>,
    /// What was measured, where anything was: times [s] and samples, none where one was lost.
    pub measured: Option<(Vec<f64>, Vec<Option<f64>>)>,
}

/// Times of a fan.
#[derive(Debug, Clone, PartialEq)]
pub enum FanTime {
    /// Nanoseconds since the Unix epoch, UTC.
    Date(Vec<i64>),
    /// Seconds.
    Seconds(Vec<f64>),
    /// Numbers of rows, of what has no times.
    Rows(Vec<f64>),
}

impl FanTime {
    /// Places on the x axis, what was cut where they are dates, and the axis' label.
    pub(super) fn axis(&self) -> (Vec<f64>, Option<Vec<Cut>>, &'static str) {
        match self {
            Self::Date(time) => {
                let DataTime { places, cuts } = DataTime::of(time);
                (places, Some(cuts), "date (UTC)")
            }
            Self::Seconds(time) => (time.clone(), None, "time [s]"),
            Self::Rows(rows) => (rows.clone(), None, "row"),
        }
    }
}

/// A band of a fan.
#[derive(Debug, Clone, PartialEq)]
pub struct FanBand {
    /// The part of all draws it holds.
    pub part: f64,
    /// Lower end, one a time.
    pub low: Vec<f64>,
    /// Upper end, one a time.
    pub high: Vec<f64>,
}
