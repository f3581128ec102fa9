//! A walk-forward as its report shows it.

use chrono::DateTime;

use crate::market::sweep::{head, shown};
use crate::report::quantity::{UNDEFINED, decimals, number};
use crate::report::{Listing, WalkForwardPage};
use crate::sim2real::Timestamp;

use super::{Step, WalkForward};

impl WalkForward {
    /// The page.
    #[must_use]
    pub fn page(&self) -> WalkForwardPage {
        WalkForwardPage {
            title: self.headline(),
            about: self.about(),
            currency: self.currency.clone(),
            time: self.equity.iter().map(|point| point.time.0).collect(),
            equity: self.equity.iter().map(|point| point.equity).collect(),
            windows: self.listing(),
        }
    }

    /// What came of it, in a sentence.
    #[must_use]
    pub fn headline(&self) -> String {
        let found = &self.out_of_sample;
        let gained =
            found.total_return.map_or_else(|| UNDEFINED.to_owned(), |part| format!("{}\u{a0}%", decimals(100.0 * part, 2)));
        let sharpe =
            found.returns.sharpe.map_or_else(String::new, |ratio| format!(", at a Sharpe ratio of {}", number(ratio)));
        format!("Out of sample, {} windows in a row gained {gained} after costs{sharpe}.", self.windows.len())
    }

    /// What the figures rest on, line by line.
    #[must_use]
    pub fn about(&self) -> Vec<String> {
        let mut said = vec![format!(
            "In each window the best {} of {} runs on the training data was chosen, and tried on the test data after them. A test begins flat, with the cash the one before it left; what it holds at its end counts at its last price.",
            self.metric, self.runs
        )];
        let (inside, outside) = self.means();
        if let (Some(inside), Some(outside)) = (inside, outside) {
            said.push(format!(
                "Mean {} over windows: {} in sample, {} out of sample. The difference is what choosing the best of many runs promised too much.",
                self.metric,
                number(inside),
                number(outside)
            ));
        }
        let failed =
            self.windows.iter().filter_map(|step| Some(format!("Window {}: {}.", step.index + 1, step.failed.as_ref()?)));
        said.extend(failed);
        let idle = self.windows.iter().filter(|step| step.chosen.is_none()).count();
        if idle > 0 {
            said.push(format!("In {idle} windows no run had the figure: nothing was chosen, and nothing traded."));
        }
        said
    }

    /// Means of the metric in and out of sample, over the windows that have both.
    fn means(&self) -> (Option<f64>, Option<f64>) {
        let both = |step: &Step| Some((step.chosen.as_ref()?.value, *step.out_of_sample.get(&self.metric)?));
        let all: Vec<(f64, f64)> = self.windows.iter().filter_map(both).collect();
        let mean =
            |of: fn(&(f64, f64)) -> f64| (!all.is_empty()).then(|| all.iter().map(of).sum::<f64>() / all.len() as f64);
        (mean(|pair| pair.0), mean(|pair| pair.1))
    }

    /// The windows as a table.
    #[must_use]
    pub fn listing(&self) -> Listing {
        let paths = self.paths();
        let day = |time: Timestamp| DateTime::from_timestamp_nanos(time.0).format("%Y-%m-%d %H:%M").to_string();
        let heads = ["train from", "to", "test from", "to"].iter().map(|head| (*head).to_owned());
        let mut figures = vec![format!("{} in sample", self.metric), "out of sample".to_owned()];
        // The return is the metric often enough.
        let others = ["total_return"].into_iter().filter(|name| *name != self.metric);
        figures.extend(others.clone().map(str::to_owned));
        let row = |step: &Step| {
            let window = &step.window;
            let times = [window.train_start, window.train_end, window.test_start, window.test_end].map(day);
            let chosen = step.chosen.as_ref();
            let values = paths.iter().map(|path| chosen.and_then(|chosen| chosen.values.get(path)).map(shown));
            let tested = |name: &str| step.out_of_sample.get(name).copied();
            let figures = [chosen.map(|chosen| chosen.value), tested(&self.metric)];
            let all = values.chain(figures.into_iter().chain(others.clone().map(tested)).map(|figure| figure.map(number)));
            times.into_iter().chain(all.map(|cell| cell.unwrap_or_else(|| UNDEFINED.to_owned()))).collect()
        };
        Listing {
            heads: heads.chain(paths.iter().map(|path| head(path, &paths))).chain(figures).collect(),
            rows: self.windows.iter().map(row).collect(),
        }
    }
}
