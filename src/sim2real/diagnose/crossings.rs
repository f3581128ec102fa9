//! Crossings: the moments at which a sensor that counts in coarse steps goes from one of them to the next.
//!
//! Between two of them a reading says no more than that the signal is somewhere within a step. At a crossing it is known to as little
//! as it moves from one row to the next. So what hides within a step is looked for there: in fewer rows, each of which tells more.
//!
//! Source: level-crossing sampling, Mark & Todd, "A nonuniform sampling approach to data compression", IEEE Transactions on
//! Communications 29 (1981).

use std::collections::BTreeMap;

use super::gates;
use super::hypothesis::{Hypothesis, Inquiry};
use super::noise::median;
use super::rivals::{self, Place};
use super::select;
use super::selection::Selection;
use super::weigh::{ACCEPT, gain};
use super::{Evidence, Found, Progress};
use crate::sim2real::{Measured, Recording, Twin};

/// Fewer crossings than this tell too little ...
const FEWEST: usize = 25;
/// ... and they must tell of the signal so many times as well as a reading does.
const FINER: f64 = 3.0;

/// Readings that change back within so many rows went back and forth by noise; what takes longer crossed twice.
const BACK_AND_FORTH: usize = 8;

/// The lag of a counter is known when it changes by less than this part of itself, or of the noise ...
const HARDLY: f64 = 0.03;
/// ... and after so many rounds.
const LAGS: usize = 10;

/// What looks like a time that a model lacks must tell more of itself than others: noise helps a signal over the border, and the more so the
/// slower it is.
const LATER: f64 = 2.5 * ACCEPT;

/// Steps hide most of what is left where that is at most this many times the mean square of their rounding.
const HIDDEN: f64 = 4.0;

/// What is selected at the crossings, going on from `selection`, and the rivals there; none where the sensor does not count, where
/// more than its steps is left, or where its readings tell as much.
pub(super) fn beneath<T: Twin>(
    inquiry: &Inquiry<'_, T>,
    selection: &Selection<T>,
    recordings: [&[Recording<T::Stimulus>]; 2],
    found: &Found<'_>,
    progress: Progress<'_>,
) -> Option<(Selection<T>, Vec<Place>)> {
    let counts = found.signs.step > 0.0 && inquiry.candidates.iter().any(|c| c.finishing);
    if !counts || !selection.selected.within(HIDDEN) {
        return None;
    }
    let crossings = Crossings::of(inquiry.twin, recordings, found.signs.step)?;
    let sought = |late| crossings.sought(inquiry, selection, late, progress);
    let (by_steps, besides) = rayon::join(|| sought(Late::BySteps), || sought(Late::Besides));
    let evidence = by_steps.0.evidence(inquiry.twin);
    let there = Inquiry { evidence: &evidence, ..*inquiry };
    let later = gain(&there, &by_steps.1.selected, &besides.1.selected) > LATER;
    let (crossings, sought) = if later { besides } else { by_steps };
    let crossings = crossings.known_by(inquiry, &sought.selected);
    let evidence = crossings.evidence(inquiry.twin);
    let there = Inquiry { evidence: &evidence, ..*inquiry };
    Some(rivals::settled(&there, sought.refitted(&there)))
}

/// Why crossings come late.
#[derive(Debug, Clone, Copy)]
enum Late {
    /// Counters change back later than they changed, lest they go back and forth for ever: by a part of a step, whichever way the signal
    /// moves.
    BySteps,
    /// By that, and by a time that a model has yet to be given: by more where the signal moves faster.
    Besides,
}

/// Recordings of which the first channel is known where it crosses from one step to the next, and nowhere else.
#[derive(Clone)]
struct Crossings<S> {
    recordings: Vec<Recording<S>>,
    held_out: Vec<Recording<S>>,
    channel: String,
    /// Standard deviation with which the signal is known there.
    noise: f64,
    /// Of each recording and then of each that is held out, the rows of crossings, and how fast the signal rises there.
    rates: Vec<BTreeMap<usize, f64>>,
}

impl<S: Clone + Send + Sync> Crossings<S> {
    /// Of a sensor that counts in steps of `step`; none where its crossings tell no more than its readings.
    pub fn of<T: Twin<Stimulus = S>>(twin: &T, [recordings, held_out]: [&[Recording<S>]; 2], step: f64) -> Option<Self> {
        let channel = twin.channels().first()?.name.to_string();
        let mut variances = Vec::new();
        let mut rates = Vec::new();
        let mut at_crossings = |all: &[Recording<S>], counted: bool| -> Vec<Recording<S>> {
            let mut all = all.to_vec();
            for recording in &mut all {
                let time = &recording.time;
                let mut own = BTreeMap::new();
                for measured in recording.measured.iter_mut().filter(|m| m.channel == channel) {
                    let found = crossings(time, measured, step);
                    measured.samples.fill(None);
                    found.iter().for_each(|c| measured.samples[c.row] = Some(c.value));
                    own.extend(found.iter().map(|c| (c.row, c.rate)));
                    variances.extend(found.iter().filter(|_| counted).map(|c| c.variance));
                }
                rates.push(own);
            }
            all
        };
        let (recordings, held_out) = (at_crossings(recordings, true), at_crossings(held_out, false));
        let noise = (variances.iter().sum::<f64>() / variances.len().max(1) as f64).sqrt();
        let tell = variances.len() >= FEWEST && noise > 0.0 && FINER * noise <= step / 12.0_f64.sqrt();
        tell.then_some(Self { recordings, held_out, channel, noise, rates })
    }

    /// The evidence they hold. Where a part starts they say little of.
    pub fn evidence<T: Twin<Stimulus = S>>(&self, twin: &T) -> Evidence<'_, S> {
        let mut evidence = Evidence::divide(twin, &self.recordings, &self.held_out).in_free_run();
        evidence.sparse = true;
        for (weight, rounding) in evidence.weights.iter_mut().zip(&mut evidence.rounding) {
            if weight.channel == self.channel {
                (weight.noise, *rounding) = (self.noise, 0.0);
            }
        }
        evidence
    }

    /// What is found beside `selection` where crossings come late for such a reason, and the crossings less what they lag beside that.
    ///
    /// What lies between crossings that are far apart is taken for noise as long as something is missing: it is sought as if they were known
    /// as well as they tell themselves.
    fn sought<T: Twin<Stimulus = S>>(
        &self,
        inquiry: &Inquiry<'_, T>,
        selection: &Selection<T>,
        late: Late,
        progress: Progress<'_>,
    ) -> (Self, Selection<T>) {
        let crossings = self.caught_up(inquiry, &selection.selected, late);
        let evidence = crossings.evidence(inquiry.twin);
        // With steps of integration as long as they may be: what is found is fitted with the twin's own in the end.
        let Hypothesis { twin, fit, .. } = &selection.selected;
        let coarse = gates::exploring_step(twin, &fit.values, &evidence).map(|step| inquiry.twin.stepping(step));
        let twin = coarse.as_ref().unwrap_or(inquiry.twin);
        let sought = select::resumed(&Inquiry { twin, evidence: &evidence, ..*inquiry }, selection, progress);
        let crossings = crossings.caught_up(inquiry, &sought.selected, Late::BySteps);
        let evidence = crossings.evidence(inquiry.twin);
        let sought = sought.refitted(&Inquiry { evidence: &evidence, ..*inquiry });
        (crossings, sought)
    }

    /// The same crossings, less what they lag behind the signal, as `hypothesis` has it: a twin takes a part of the lag for its own, and
    /// gives it back as that is taken away.
    fn caught_up<T: Twin<Stimulus = S>>(&self, inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>, late: Late) -> Self {
        let mut crossings = self.clone();
        let mut hypothesis = hypothesis.clone();
        let mut whole = 0.0_f64;
        for _ in 0..LAGS {
            let evidence = crossings.evidence(inquiry.twin);
            let there = Inquiry { evidence: &evidence, ..*inquiry };
            hypothesis = there.refitted_afresh(&hypothesis);
            let left = crossings.left(&there, &hypothesis);
            let lag = match late {
                Late::BySteps => median(left.iter().flatten().map(|[rate, left]| -rate.signum() * left).collect()),
                Late::Besides => by_steps(&left.concat()),
            };
            if lag.abs() <= HARDLY * whole.max(self.noise) {
                break;
            }
            whole += lag;
            crossings = crossings.moved(lag);
        }
        crossings
    }

    /// The same crossings, later by that much of the signal.
    fn moved(&self, lag: f64) -> Self {
        let corrected = |all: &[Recording<S>], rates: &[BTreeMap<usize, f64>]| -> Vec<Recording<S>> {
            let mut all = all.to_vec();
            for (recording, rates) in all.iter_mut().zip(rates) {
                for measured in recording.measured.iter_mut().filter(|m| m.channel == self.channel) {
                    for (row, rate) in rates {
                        measured.samples[*row] = measured.samples[*row].map(|value| value + lag * rate.signum());
                    }
                }
            }
            all
        };
        let (own, of_held_out) = self.rates.split_at(self.recordings.len());
        Self {
            recordings: corrected(&self.recordings, own),
            held_out: corrected(&self.held_out, of_held_out),
            ..self.clone()
        }
    }

    /// The same, as well known as what `hypothesis` leaves of them has it: what a model lacks stays much the same from one crossing to
    /// the next, and noise does not.
    pub fn known_by<T: Twin<Stimulus = S>>(&self, inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> Self {
        let evidence = self.evidence(inquiry.twin);
        let there = Inquiry { evidence: &evidence, ..*inquiry };
        let left = self.left(&there, &there.refitted_afresh(hypothesis));
        let between = left.iter().flat_map(|run| run.windows(2).map(|w| (w[1][1] - w[0][1]).abs()));
        let scatter = median(between.collect()) / 0.674_489_75 / 2.0_f64.sqrt();
        Self { noise: self.noise.max(scatter), ..self.clone() }
    }

    /// What `hypothesis` leaves of the crossings, in the channel's unit, beside the rates there: one run a part.
    fn left<T: Twin<Stimulus = S>>(&self, inquiry: &Inquiry<'_, T>, hypothesis: &Hypothesis<T>) -> Vec<Vec<[f64; 2]>> {
        let parts = &inquiry.evidence.compared;
        let blocks = inquiry.problem(&hypothesis.twin, parts).blocks();
        let own = blocks.iter().filter(|block| block.channel == self.channel);
        own.filter_map(|block| {
            let name = &parts[block.part].recording.name;
            let rates = &self.rates[self.recordings.iter().position(|r| r.name == *name)?];
            let left = &hypothesis.fit.residual.as_slice()[block.range.clone()];
            let beside = |(row, left): (&usize, &f64)| [rates.get(row).copied().unwrap_or(0.0), self.noise * left];
            Some(block.rows.iter().zip(left).map(beside).collect())
        })
        .collect()
    }
}

/// By what crossings come late that leave so much, each beside the rate there, whichever way the signal moves, where they may come late by
/// a time besides: least squares in both.
fn by_steps(left: &[[f64; 2]]) -> f64 {
    let sum = |of: fn(f64, f64) -> f64| left.iter().map(|[rate, left]| of(rate.abs(), -rate.signum() * left)).sum::<f64>();
    let (pace, square) = (sum(|pace, _| pace), sum(|pace, _| pace * pace));
    let (late, by_pace) = (sum(|_, late| late), sum(|pace, late| pace * late));
    let determinant = left.len() as f64 * square - pace * pace;
    if determinant > 0.0 { (square * late - pace * by_pace) / determinant } else { 0.0 }
}

/// One crossing: the signal at the row nearest to it, and how well that is known.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Crossing {
    row: usize,
    value: f64,
    rate: f64,
    variance: f64,
}

/// Readings that go from one step to the next, perhaps back and forth for a moment.
#[derive(Debug, Clone, PartialEq)]
struct Border {
    /// Where one step ends and the next begins.
    level: f64,
    /// The rows after each change.
    rows: Vec<usize>,
    /// When the readings changed, half-way between two rows.
    times: Vec<f64>,
    /// Whether these are neighbouring steps.
    next_to_each_other: bool,
}

impl Border {
    fn time(&self) -> f64 {
        self.times.iter().sum::<f64>() / self.times.len() as f64
    }

    fn scatter(&self) -> f64 {
        let mean = self.time();
        self.times.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / self.times.len() as f64
    }
}

/// The crossings of one channel, in the order of their rows.
fn crossings(time: &[f64], measured: &Measured, step: f64) -> Vec<Crossing> {
    let mut found = Vec::new();
    let mut from = 0;
    // What happened while samples were lost nobody knows.
    for seen in measured.samples.chunk_by(|a, b| a.is_some() == b.is_some()) {
        let readings: Vec<f64> = seen.iter().flatten().copied().collect();
        let borders = borders(&time[from..from + seen.len()], &readings, step);
        found.extend(borders.windows(3).filter_map(|w| crossed(time, from, &w[0], &w[1], &w[2])));
        from += seen.len();
    }
    found
}

/// Where consecutive readings change, what goes back and forth for a moment taken together.
fn borders(time: &[f64], readings: &[f64], step: f64) -> Vec<Border> {
    let mut borders: Vec<Border> = Vec::new();
    for (row, pair) in readings.windows(2).enumerate().filter(|(_, pair)| pair[0] != pair[1]) {
        let (level, at) = (0.5 * (pair[0] + pair[1]), 0.5 * (time[row] + time[row + 1]));
        let goes_on = |last: &&mut Border| {
            (last.level - level).abs() < 0.25 * step
                && last.rows.last().is_some_and(|before| row + 1 - before < BACK_AND_FORTH)
        };
        match borders.last_mut().filter(goes_on) {
            Some(same) => {
                same.rows.push(row + 1);
                same.times.push(at);
            }
            None => borders.push(Border {
                level,
                rows: vec![row + 1],
                times: vec![at],
                next_to_each_other: (pair[1] - pair[0]).abs() < 1.5 * step,
            }),
        }
    }
    borders
}

/// The crossing of `border` between those before and after it, in readings that begin at the row `from`. None where the signal came
/// near and turned back, or passed several steps at once.
fn crossed(time: &[f64], from: usize, before: &Border, border: &Border, after: &Border) -> Option<Crossing> {
    if border.rows.len().is_multiple_of(2) || !border.next_to_each_other {
        return None;
    }
    let (then, now, later) = (before.time(), border.time(), after.time());
    let (early, late) = ((border.level - before.level) / (now - then), (after.level - border.level) / (later - now));
    // The rate of the parabola through the three.
    let rate = (early * (later - now) + late * (now - then)) / (later - then);
    let row = from + border.rows[border.rows.len() / 2];
    let apart = time[row] - time[row - 1];
    let variance = rate.powi(2) * (apart.powi(2) / 12.0 + border.scatter());
    Some(Crossing { row, value: border.level + rate * (time[row] - now), rate, variance })
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f64 = 0.2;

    fn signal(t: f64) -> f64 {
        (1.7 * t).sin() + 0.6 * (0.6 * t).cos()
    }

    fn counted(samples: impl Iterator<Item = f64>) -> Measured {
        let samples = samples.map(|y| Some((y / STEP).round() * STEP)).collect();
        Measured { channel: "y".into(), unit: String::new(), samples }
    }

    #[test]
    fn a_signal_is_known_where_it_crosses_as_well_as_it_moves_between_two_rows() {
        let time: Vec<f64> = (0..6_000).map(|i| 4e-3 * f64::from(i)).collect();
        let found = crossings(&time, &counted(time.iter().map(|t| signal(*t))), STEP);
        assert!(found.len() > 60, "{}", found.len());
        for crossing in &found {
            let error = crossing.value - signal(time[crossing.row]);
            assert!(error.abs() < 0.1 * STEP / 12.0_f64.sqrt(), "row {}: {error}", crossing.row);
        }
        let expected = found.iter().map(|c| c.variance).sum::<f64>() / found.len() as f64;
        let squares = found.iter().map(|c| (c.value - signal(time[c.row])).powi(2)).sum::<f64>() / found.len() as f64;
        assert!((0.5..2.0).contains(&(squares / expected)), "{squares} of {expected}");
    }

    #[test]
    fn readings_that_go_back_and_forth_cross_once_and_those_that_turn_back_later_twice() {
        let time: Vec<f64> = (0..400).map(|i| 1e-2 * f64::from(i)).collect();
        // Up over three borders, back and forth at the second.
        let up = |i: usize| STEP * ((i >= 100) as u8 + ((i >= 200 && i != 201) || i == 198) as u8 + (i >= 300) as u8) as f64;
        let found = crossings(&time, &counted((0..400).map(up)), STEP);
        assert_eq!(found.iter().map(|c| c.row).collect::<Vec<_>>(), [200], "{found:?}");
        // Up over two and, long after, back.
        let turns = |i: usize| STEP * ((50..350).contains(&i) as u8 + (150..250).contains(&i) as u8) as f64;
        let found = crossings(&time, &counted((0..400).map(turns)), STEP);
        assert_eq!(found.iter().map(|c| (c.row, c.rate > 0.0)).collect::<Vec<_>>(), [(150, true), (250, false)]);
    }

    #[test]
    fn what_happens_while_samples_are_lost_is_no_crossing() {
        let time: Vec<f64> = (0..6_000).map(|i| 4e-3 * f64::from(i)).collect();
        let mut measured = counted(time.iter().map(|t| signal(*t)));
        let whole = crossings(&time, &measured, STEP);
        measured.samples[2_000..4_000].fill(None);
        let found = crossings(&time, &measured, STEP);
        assert!(!found.is_empty() && found.len() < whole.len());
        assert!(found.iter().all(|c| whole.contains(c)), "all of them are of the whole too");
    }
}
