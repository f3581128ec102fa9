//! Fan charts.

use minijinja::{Value, context};

use crate::report::fan::{Fan, FanTime};
use crate::report::plot::{Curve, Ink, Mark, Plot, Scale};
use crate::report::quantity::{axis, whole_percent};
use crate::report::section::{ReportError, Section, fill};

use super::equity::gaps;

pub(in crate::report) struct Fans<'a> {
    pub title: &'static str,
    pub about: &'a [String],
    pub fans: &'a [Fan],
}

/// Plots of one page at most; the rest are listed by name.
const SHOWN: usize = 8;
/// Columns of all plots together.
const COLUMNS: usize = 3_000;

impl Section for Fans<'_> {
    fn id(&self) -> &'static str {
        "fans"
    }

    fn title(&self) -> &'static str {
        self.title
    }

    fn render(&self) -> Result<String, ReportError> {
        if self.fans.is_empty() {
            return Ok(String::new());
        }
        let columns = (COLUMNS / self.fans.len().min(SHOWN)).min(1_000);
        let plots: Vec<Value> = self.fans.iter().take(SHOWN).enumerate().map(|(k, fan)| plot(k, fan, columns)).collect();
        let rest: Vec<String> = self.fans.iter().skip(SHOWN).map(|fan| fan.caption.clone()).collect();
        let bands: Vec<Value> = self.fans[0]
            .bands
            .iter()
            .enumerate()
            .map(|(k, band)| context! { part => whole_percent(band.part), class => ["inner", "middle", ""][k.min(2)] })
            .collect();
        fill(
            "fans.html",
            include_str!("../templates/fans.html"),
            context! {
                about => self.about.to_vec(),
                plots => plots,
                rest => rest,
                bands => bands,
                measured => self.fans.iter().any(|fan| fan.measured.is_some()),
            },
        )
    }
}

fn plot(k: usize, fan: &Fan, columns: usize) -> Value {
    let (time, cuts, x_label) = fan.time.axis();
    // Both ends of a band stand at the same places.
    let twice: Vec<f64> = time.iter().chain(&time).copied().collect();
    let some = |values: &[f64]| values.iter().map(|v| Some(*v)).collect::<Vec<_>>();
    // The widest first: the narrower lie on it and are darker by that.
    let bands = fan.bands.iter().rev().map(|band| {
        let y = band.low.iter().chain(&band.high).map(|v| Some(*v)).collect();
        Curve { ink: Ink::Band, mark: Mark::Between, x: &twice, y }
    });
    let line = |ink, x, y| Curve { ink, mark: Mark::Line, x, y };
    let measured = fan.measured.iter().map(|(x, y)| line(Ink::Measured, x.as_slice(), y.clone()));
    let own = [line(Ink::Median, &time, some(&fan.median)), line(Ink::Nominal, &time, some(&fan.nominal))];
    // A simulation that runs away must not flatten everything else.
    let within = span(fan).map(|(low, high)| (low - 2.0 * (high - low).max(1e-12), high + 2.0 * (high - low).max(1e-12)));
    let plot = Plot {
        alt: format!("{}: median, bands and nominal over time", fan.caption),
        x_label: x_label.into(),
        y_label: axis(&fan.quantity.0, &fan.quantity.1),
        shades: cuts.as_deref().map(gaps).unwrap_or_default(),
        scale: cuts.map_or(Scale::Number, Scale::Date),
        curves: bands.chain(measured).chain(own).collect(),
        zero: false,
        diagonal: false,
        within,
        height: (330.0, 250.0),
        columns,
    };
    let beside = departures(fan).map(|departed| {
        let Departed { bands, measured, nominal } = &departed;
        let bands = bands.iter().rev().map(|y| Curve { ink: Ink::Band, mark: Mark::Between, x: &twice, y: y.clone() });
        // Noise drawn as a line would hide what it is held against.
        let dots = Curve { ink: Ink::Measured, mark: Mark::Dots, x: &time, y: measured.clone() };
        let lines = [dots, line(Ink::Nominal, &time, nominal.clone())];
        // Half as much again as the widest band: what runs away is seen to, and flattens nothing.
        let reach = 1.5 * departed.reach();
        let plot = Plot {
            alt: format!("{}: bands, measured and nominal less the median, over time", fan.caption),
            y_label: axis("departure", &fan.quantity.1),
            curves: bands.chain(lines).collect(),
            zero: true,
            within: Some((-reach, reach)),
            height: (230.0, 200.0),
            ..plot.clone()
        };
        plot.draw(&format!("fan-{k}-d"))
    });
    context! {
        caption => &fan.caption,
        plot => Value::from_safe_string(plot.draw(&format!("fan-{k}"))),
        beside => Value::from_safe_string(beside.unwrap_or_default()),
    }
}

/// How far bands, measurement and nominal depart from the median: bands are often narrower than a line is wide.
struct Departed {
    /// Lower and upper ends one after the other, the narrowest band first.
    bands: Vec<Vec<Option<f64>>>,
    measured: Vec<Option<f64>>,
    nominal: Vec<Option<f64>>,
}

impl Departed {
    /// The farthest end of the widest band.
    fn reach(&self) -> f64 {
        let ends = self.bands.iter().flatten().flatten().filter(|v| v.is_finite());
        ends.fold(0.0_f64, |most, v| most.max(v.abs())).max(1e-12)
    }
}

/// The departures of a fan beside which something was measured; none of another.
fn departures(fan: &Fan) -> Option<Departed> {
    let (Some((times, samples)), FanTime::Seconds(time)) = (&fan.measured, &fan.time) else { return None };
    let mut rows = times.iter().zip(samples).peekable();
    let mut at = |t: f64| {
        while rows.next_if(|(time, _)| **time < t).is_some() {}
        rows.peek().filter(|(time, _)| **time == t).and_then(|(_, sample)| **sample)
    };
    let less = |values: &[f64]| values.iter().zip(&fan.median).map(|(v, m)| Some(v - m)).collect::<Vec<_>>();
    let band = |band: &crate::report::fan::FanBand| less(&band.low).into_iter().chain(less(&band.high)).collect();
    Some(Departed {
        bands: fan.bands.iter().map(band).collect(),
        measured: time.iter().zip(&fan.median).map(|(t, m)| at(*t).map(|v| v - m)).collect(),
        nominal: less(&fan.nominal),
    })
}

/// The least and the largest of what was measured, or else of the widest band.
fn span(fan: &Fan) -> Option<(f64, f64)> {
    let all: Vec<f64> = match &fan.measured {
        Some((_, samples)) => samples.iter().flatten().copied().collect(),
        None => fan.bands.last().into_iter().flat_map(|band| band.low.iter().chain(&band.high).copied()).collect(),
    };
    let finite = all.into_iter().filter(|v| v.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    (low <= high).then_some((low, high))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::fan::FanBand;

    #[test]
    fn bands_lie_behind_lines_and_the_widest_behind_all() {
        let time: Vec<f64> = (0..50).map(f64::from).collect();
        let level = |value: f64| vec![value; 50];
        let fan = Fan {
            caption: "run.csv <position>".into(),
            quantity: ("position".into(), "rad".into()),
            time: FanTime::Seconds(time.clone()),
            median: level(0.0),
            bands: [0.5, 0.95].map(|part| FanBand { part, low: level(-part), high: level(part) }).to_vec(),
            nominal: level(0.2),
            measured: Some((time, vec![Some(0.1); 50])),
        };
        let html = Fans { title: "Draws", about: &[], fans: &[fan] }.render().unwrap();
        assert_eq!(
            html.matches("fill-opacity=\"0.3\"").count(),
            8,
            "two bands in two plots, on wide screens and narrow ones"
        );
        let (band, line) = (html.find("var(--band)").unwrap(), html.find("var(--nominal)").unwrap());
        assert!(band < line && html.contains("95\u{a0}%") && html.contains("run.csv &lt;position&gt;"), "{html}");
    }
}
