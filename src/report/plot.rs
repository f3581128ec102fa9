//! Plots, as SVG inside the page: the only module that knows the plotting library.
//!
//! Every plot is drawn twice, for wide and for narrow screens, because a picture scaled down to a phone has letters
//! nobody can read. Colours are CSS variables, so that one picture serves light and dark.

mod svg;

use chrono::DateTime;
use kuva::plot::band::BandPlot;
use kuva::plot::scatter::ScatterPlot;
use kuva::plot::{LinePlot, LineStyle};
use kuva::render::annotations::{ReferenceLine, ShadedRegion, TextAnnotation};
use kuva::render::datetime::{DateTimeAxis, DateUnit};
use kuva::render::layout::{Layout, TickFormat};
use kuva::render::render::render_multiple;
use kuva::render::theme::Theme;

use super::data_time::{Cut, instant};
use super::decimate::{extremes, thin};
use super::quantity::tick;

/// Who a curve belongs to; each has one colour and one dash in every plot of every page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ink {
    Measured,
    Nominal,
    Recalibrated,
    Trued,
    Equity,
    Loss,
    /// How far a result might lie.
    Bound,
    /// The middle of many draws.
    Median,
    /// What a series keeps to for a while, beside the colours of its states.
    Level,
    /// What a part of many draws lies within.
    Band,
    /// One of several things of a kind, told apart by its number.
    Member(usize),
}

impl Ink {
    /// Number of colours for members of a kind.
    pub(super) const MEMBERS: usize = 4;

    /// Name of its CSS variable and class.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Nominal => "nominal",
            Self::Recalibrated => "recalibrated",
            Self::Trued => "trued",
            Self::Equity => "equity",
            Self::Loss => "loss",
            Self::Bound => "bound",
            Self::Median => "median",
            Self::Level => "level",
            Self::Band => "band",
            Self::Member(k) => ["member-0", "member-1", "member-2", "member-3"][k % Self::MEMBERS],
        }
    }

    fn color(self) -> String {
        format!("var(--{})", self.name())
    }

    fn width(self) -> f64 {
        match self {
            Self::Measured => 4.5,
            Self::Bound => 1.0,
            _ => 1.7,
        }
    }

    /// Dashes tell the twins apart where colour does not.
    fn style(self) -> LineStyle {
        match self {
            Self::Nominal => LineStyle::Custom("1.5 4".into()),
            Self::Recalibrated => LineStyle::Custom("7 4".into()),
            Self::Bound => LineStyle::Custom("3 3".into()),
            _ => LineStyle::Solid,
        }
    }
}

/// How a curve is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Line,
    /// A line, and the area between it and zero.
    Area,
    /// A value holds until the next.
    Step,
    Dots,
    /// The area between the first half of the points and the second, which are of the same places.
    Between,
}

/// One series.
#[derive(Debug, Clone)]
pub(super) struct Curve<'a> {
    pub ink: Ink,
    pub mark: Mark,
    pub x: &'a [f64],
    pub y: Vec<Option<f64>>,
}

/// A stretch of the x axis to point at.
#[derive(Debug, Clone)]
pub(super) struct Shade {
    pub start: f64,
    pub end: f64,
    pub label: String,
    pub tint: Tint,
}

/// What a shade points at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tint {
    /// Where the twin errs.
    Misfit,
    /// Where what was found acted.
    Active,
}

impl Tint {
    fn color(self) -> &'static str {
        match self {
            Self::Misfit => "var(--shade)",
            Self::Active => "var(--active)",
        }
    }
}

/// What the x axis counts.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Scale {
    Number,
    /// Places of [`DataTime`](super::data_time::DataTime) with these cuts; without any, seconds since the Unix epoch, UTC.
    Date(Vec<Cut>),
}

/// A plot, before it is drawn.
#[derive(Debug, Clone)]
pub(super) struct Plot<'a> {
    /// What the plot shows, for those who cannot see it.
    pub alt: String,
    pub x_label: String,
    pub y_label: String,
    pub scale: Scale,
    pub curves: Vec<Curve<'a>>,
    pub shades: Vec<Shade>,
    /// Whether to mark y = 0.
    pub zero: bool,
    /// Whether both axes show the same quantity: equal ranges, and the line on which they agree.
    pub diagonal: bool,
    /// What of the y axis to show at most: a simulation that runs away must not flatten everything else.
    pub within: Option<(f64, f64)>,
    /// Heights [px] on wide and narrow screens.
    pub height: (f64, f64),
    /// Columns to draw at most on a wide screen; points are at most twice as many a curve.
    pub columns: usize,
}

/// Widths of the two drawings [px].
const WIDE: f64 = 1080.0;
const NARROW: f64 = 344.0;
/// Room for the labels of the y axis [px].
const MARGIN_LEFT: f64 = 70.0;
/// Dots of one series at most.
const DOTS: usize = 600;

impl Plot<'_> {
    /// Both drawings, or the narrow one alone where the axes are alike; `id` must be unique within the page.
    pub(super) fn draw(&self, id: &str) -> String {
        if self.diagonal {
            return format!("<div class=\"drawing\">{}</div>", self.on_canvas(id, NARROW, self.height.1, 0));
        }
        let narrow_columns = self.columns.min(NARROW as usize).min(self.columns / 2 + 100);
        format!(
            "<div class=\"drawing wide\">{}</div><div class=\"drawing narrow\">{}</div>",
            self.on_canvas(&format!("{id}-w"), WIDE, self.height.0, self.columns),
            self.on_canvas(&format!("{id}-n"), NARROW, self.height.1, narrow_columns)
        )
    }

    /// The narrow drawing alone: for plots that stand beside one another.
    pub(super) fn draw_narrow(&self, id: &str) -> String {
        format!("<div class=\"drawing\">{}</div>", self.on_canvas(id, NARROW, self.height.1, self.columns))
    }

    fn on_canvas(&self, id: &str, width: f64, height: f64, columns: usize) -> String {
        let (x, y) = self.ranges();
        let layout = self.layout(x, y, width, height);
        let mut marks = self.marks(columns);
        if self.diagonal {
            let agreement = LinePlot::new().with_data([x.0, x.1].map(|v| (v, v))).with_color("var(--rule)");
            marks.insert(0, agreement.with_stroke_width(1.5).into());
        }
        let scene = render_multiple(marks, layout);
        svg::write(&scene, id, &self.alt)
    }

    fn marks(&self, columns: usize) -> Vec<kuva::render::plots::Plot> {
        let mut marks = Vec::new();
        for curve in &self.curves {
            if curve.mark == Mark::Dots {
                let points: Vec<_> = curve.x.iter().zip(&curve.y).filter_map(|(x, y)| Some((*x, (*y)?))).collect();
                let dots = ScatterPlot::new().with_data(thin(&points, DOTS)).with_color(curve.ink.color());
                marks.push(dots.with_size(2.2).with_marker_opacity(0.75).into());
                continue;
            }
            if curve.mark == Mark::Between {
                let (x, half) = (&curve.x[..curve.x.len() / 2], curve.x.len() / 2);
                let whole: Option<Vec<f64>> = curve.y.iter().map(|y| y.filter(|y| y.is_finite())).collect();
                if let Some(y) = whole.filter(|_| half > 1) {
                    let band = BandPlot::new(x.to_vec(), y[..half].to_vec(), y[half..].to_vec());
                    marks.push(band.with_color(curve.ink.color()).with_opacity(0.3).into());
                }
                continue;
            }
            for mut stretch in extremes(curve.x, &curve.y, columns) {
                // A lone sample is a line of no length, which round caps make a dot.
                if let [only] = stretch[..] {
                    stretch.push(only);
                }
                let line = LinePlot::new().with_data(stretch).with_color(curve.ink.color());
                let line = line.with_stroke_width(curve.ink.width()).with_line_style(curve.ink.style());
                let line = match curve.mark {
                    Mark::Area => line.with_fill().with_fill_opacity(0.16),
                    Mark::Step => line.with_step(),
                    Mark::Line | Mark::Dots | Mark::Between => line,
                };
                marks.push(line.into());
            }
        }
        marks
    }

    /// The ranges of both axes: all there is, with a little room above and below.
    fn ranges(&self) -> ((f64, f64), (f64, f64)) {
        let all = |values: &mut dyn Iterator<Item = f64>| {
            values.filter(|v| v.is_finite()).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
        };
        let mut x = all(&mut self.curves.iter().flat_map(|c| c.x.iter().copied()));
        let mut y = all(&mut self.curves.iter().flat_map(|c| c.y.iter().flatten().copied()));
        if let Some((low, high)) = self.within {
            y = (y.0.max(low), y.1.min(high));
        }
        if self.zero {
            y = (y.0.min(0.0), y.1.max(0.0));
        }
        if self.diagonal {
            let both = (x.0.min(y.0), x.1.max(y.1));
            (x, y) = (padded(both), padded(both));
            return (x, y);
        }
        if x.0 >= x.1 {
            x = if x.0.is_finite() { (x.0 - 0.5, x.0 + 0.5) } else { (0.0, 1.0) };
        }
        (x, padded(y))
    }

    fn layout(&self, x: (f64, f64), y: (f64, f64), width: f64, height: f64) -> Layout {
        let mut theme = Theme::light();
        theme.background = "none".into();
        theme.axis_color = "var(--rule)".into();
        theme.tick_color = "var(--rule)".into();
        theme.grid_color = "var(--grid)".into();
        theme.text_color = "var(--soft)".into();
        let x_step = round_step((x.1 - x.0) / (width / 95.0).max(2.0));
        // Dates with their years are wide, and the last may stand at the very end.
        let cut = matches!(&self.scale, Scale::Date(cuts) if !cuts.is_empty());
        let margin_right = if cut { 38.0 } else { 12.0 };
        let mut layout = Layout::new(x, y)
            .with_width(width)
            .with_height(height)
            .with_theme(theme)
            .with_x_axis_min(x.0)
            .with_x_axis_max(x.1)
            .with_y_axis_min(y.0)
            .with_y_axis_max(y.1)
            .with_y_tick_step(round_step((y.1 - y.0) / ((height - 60.0) / 36.0).max(2.0)))
            // The same margins everywhere, so that plots of the same time stand exactly below each other.
            .with_force_margins(MARGIN_LEFT, margin_right)
            .with_force_margins_y(8.0, if self.x_label.is_empty() { 26.0 } else { 46.0 })
            .with_x_label(plain(&self.x_label))
            .with_y_label(plain(&self.y_label))
            .with_tick_format(TickFormat::Custom(std::sync::Arc::new(tick)))
            .with_tick_size(12)
            .with_label_size(13)
            .with_tick_length(4.0);
        layout = match &self.scale {
            Scale::Number => layout.with_x_tick_step(x_step),
            Scale::Date(cuts) if cuts.is_empty() => layout.with_x_datetime(date_axis(x.1 - x.0, width / 86.0).0),
            Scale::Date(cuts) => {
                // Ticks of whole days, with their years: a cut may lie between any two.
                let (_, seconds) = date_axis(x.1 - x.0, width / 100.0);
                let step = (seconds / DAY).round().max(1.0) * DAY;
                let cuts = cuts.clone();
                // Within a cut there is nothing to date.
                let date = move |place: f64| {
                    let cut = cuts.iter().any(|cut| place > cut.around.0 && place < cut.around.1);
                    if cut { String::new() } else { date(instant(place, &cuts)) }
                };
                layout.with_x_tick_step(step).with_x_tick_format(TickFormat::Custom(std::sync::Arc::new(date)))
            }
        };
        for shade in &self.shades {
            let (start, end) = (shade.start.max(x.0), shade.end.min(x.1));
            if end <= start {
                continue;
            }
            layout = layout
                .with_shaded_region(ShadedRegion::vertical(start, end).with_color(shade.tint.color()).with_opacity(1.0));
            // A label wider than its stretch would run into its neighbour's.
            if (end - start) / (x.1 - x.0) * width > 34.0 {
                let top = y.1 - 10.0 / height * (y.1 - y.0);
                let note = TextAnnotation::new(plain(&shade.label), 0.5 * (start + end), top - 10.0 / height * (y.1 - y.0));
                layout = layout.with_annotation(note.with_font_size(11));
            }
        }
        if self.zero && y.0 < 0.0 && y.1 > 0.0 {
            let line = ReferenceLine::horizontal(0.0).with_color("var(--rule)").with_dasharray("none");
            layout = layout.with_reference_line(line);
        }
        layout
    }
}

/// Labels without the plotting library's formula mark.
fn plain(label: &str) -> String {
    label.replace('$', "\\$")
}

fn padded((low, high): (f64, f64)) -> (f64, f64) {
    if !low.is_finite() || !high.is_finite() || high < low {
        return (0.0, 1.0);
    }
    let room = if high > low { 0.06 * (high - low) } else { (0.05 * high.abs()).max(1e-9) };
    (low - room, high + room)
}

/// What of 1, 2, 2.5, 5 times a power of ten is nearest to `step`, as ratios go.
fn round_step(step: f64) -> f64 {
    let power = 10.0_f64.powf(step.log10().floor());
    let leading = step / power;
    let distance = |round: f64| (round / leading).ln().abs();
    let nearest = [1.0, 2.0, 2.5, 5.0, 10.0].into_iter().min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
    nearest.unwrap_or(1.0) * power
}

const DAY: f64 = 86_400.0;

/// The day of an instant [s since the Unix epoch, UTC].
fn date(seconds: f64) -> String {
    DateTime::from_timestamp(seconds as i64, 0).map_or_else(String::new, |time| time.format("%Y-%m-%d").to_string())
}

/// Calendar ticks, at most `most` of them over `span` seconds, and their distance [s].
fn date_axis(span: f64, most: f64) -> (DateTimeAxis, f64) {
    const MINUTE: f64 = 60.0;
    const HOUR: f64 = 60.0 * MINUTE;
    const MONTH: f64 = 30.44 * DAY;
    const YEAR: f64 = 365.25 * DAY;
    let steps = [
        (DateUnit::Second, 1, 1.0, "%H:%M:%S"),
        (DateUnit::Second, 10, 10.0, "%H:%M:%S"),
        (DateUnit::Minute, 1, MINUTE, "%H:%M"),
        (DateUnit::Minute, 5, 5.0 * MINUTE, "%H:%M"),
        (DateUnit::Minute, 15, 15.0 * MINUTE, "%H:%M"),
        (DateUnit::Hour, 1, HOUR, "%H:%M"),
        (DateUnit::Hour, 3, 3.0 * HOUR, "%b %d %H:%M"),
        (DateUnit::Hour, 12, 12.0 * HOUR, "%b %d %H:%M"),
        (DateUnit::Day, 1, DAY, "%b %d"),
        (DateUnit::Day, 2, 2.0 * DAY, "%b %d"),
        (DateUnit::Week, 1, 7.0 * DAY, "%b %d"),
        (DateUnit::Week, 2, 14.0 * DAY, "%b %d"),
        (DateUnit::Month, 1, MONTH, "%b %Y"),
        (DateUnit::Month, 3, 3.0 * MONTH, "%b %Y"),
        (DateUnit::Month, 6, 6.0 * MONTH, "%b %Y"),
        (DateUnit::Year, 1, YEAR, "%Y"),
        (DateUnit::Year, 2, 2.0 * YEAR, "%Y"),
        (DateUnit::Year, 5, 5.0 * YEAR, "%Y"),
    ];
    let fits = steps.into_iter().find(|(_, _, seconds, _)| span / seconds <= most);
    let (unit, step, seconds, format) = fits.unwrap_or((DateUnit::Year, 10, 10.0 * YEAR, "%Y"));
    (DateTimeAxis { unit, step, format: format.into() }, seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot<'a>(x: &'a [f64], y: Vec<Option<f64>>) -> Plot<'a> {
        Plot {
            alt: "a \"test\" <plot>".into(),
            x_label: "time [s]".into(),
            y_label: "cost [$]".into(),
            scale: Scale::Number,
            curves: vec![Curve { ink: Ink::Trued, mark: Mark::Line, x, y }],
            shades: vec![Shade { start: -5.0, end: 2.0, label: "40 %".into(), tint: Tint::Misfit }],
            zero: true,
            diagonal: false,
            within: None,
            height: (260.0, 220.0),
            columns: 900,
        }
    }

    #[test]
    fn long_traces_are_compact_and_the_same_every_time() {
        let x: Vec<f64> = (0..200_000).map(|i| f64::from(i) * 1e-3).collect();
        let y: Vec<Option<f64>> = x.iter().map(|x| Some((3.0 * x).sin())).collect();
        let plot = plot(&x, y);
        let drawn = plot.draw("p");
        assert_eq!(drawn, plot.draw("p"));
        assert!(drawn.len() < 45_000, "{} bytes", drawn.len());
        assert!(drawn.contains("var(--trued)") && drawn.contains("cost [$]"), "colour and unit");
        assert!(drawn.contains("aria-label=\"a &quot;test&quot; &lt;plot&gt;\""));
        assert!(!drawn.contains("http") && !drawn.contains("NaN") && !drawn.contains("kuva"));
        assert_eq!(drawn.matches("<svg").count(), 2);
        assert_eq!(drawn.matches("<g").count(), drawn.matches("</g>").count());
    }

    #[test]
    fn nothing_to_show_is_still_a_plot() {
        for (x, y) in [(vec![], vec![]), (vec![1.0], vec![Some(2.0)]), (vec![1.0, 2.0], vec![None, Some(f64::INFINITY)])] {
            let drawn = plot(&x, y).draw("p");
            assert!(drawn.contains("</svg>") && !drawn.contains("NaN") && !drawn.contains("inf"), "{drawn}");
        }
    }

    #[test]
    fn steps_are_round() {
        assert_eq!((round_step(0.23), round_step(20.0), round_step(8.0)), (0.25, 20.0, 10.0));
        assert_eq!(date_axis(86_400.0 * 365.0, 9.0).0.step, 3);
        assert_eq!(date_axis(86_400.0 * 36_500.0, 3.0).0.step, 10);
    }
}
