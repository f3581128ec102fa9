//! Automatic domain randomization: ranges that widen where a policy does well at their ends.

use serde::{Deserialize, Serialize};

use super::Target;
use super::stream::{Occasion, Streams, name_key, uniform};
use crate::sim2real::Seed;

/// What automatic domain randomization goes by.
///
/// Source: OpenAI et al., "Solving Rubik's Cube with a robot hand", arXiv:1910.07113 (2019), section 5 and algorithm 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdrSettings {
    /// The part of episodes in which one parameter is put to an end of its range, to see how well the policy does there.
    pub boundary_probability: f64,
    /// Episodes at an end after which it is judged.
    pub buffer: usize,
    /// Mean performance at an end at and below which the range narrows there.
    pub low: f64,
    /// Mean performance at an end at and above which it widens there.
    pub high: f64,
}

/// The range of one parameter, as far as it has come.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AdrRange {
    /// Name of the parameter.
    pub name: String,
    /// Lower end now.
    pub low: f64,
    /// Upper end now.
    pub high: f64,
    /// Ends that the range never leaves.
    pub limits: [f64; 2],
    /// By how much an end moves at a time.
    pub step: f64,
    /// The value from which the range began: neither end ever passes it.
    origin: f64,
    /// Performances so far at the lower and at the upper end.
    performances: [Vec<f64>; 2],
}

/// An end of a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// The lower one.
    Low,
    /// The upper one.
    High,
}

/// An episode that tries an end of a parameter's range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Boundary {
    /// Number of the parameter.
    pub parameter: usize,
    /// Which end.
    pub end: End,
}

/// The values of an episode.
#[derive(Debug, Clone, PartialEq)]
pub struct AdrSample {
    /// One a parameter.
    pub values: Vec<f64>,
    /// The end that is tried, where one is.
    pub boundary: Option<Boundary>,
}

/// What a performance did to a range.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AdrChange {
    /// There is not enough to judge by, or nothing to say.
    None,
    /// The range is wider.
    Widened,
    /// The range is narrower.
    Narrowed,
}

/// Why ranges cannot be widened automatically.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AdrError {
    /// A setting that makes no sense.
    #[error("expected {expected}, found {found}\nhint: {hint}")]
    Setting {
        /// What was expected.
        expected: &'static str,
        /// What was found.
        found: f64,
        /// What to do.
        hint: &'static str,
    },
    /// A range that cannot be.
    #[error(
        "the range of `{name}` cannot be: from {from}, within {low} to {high}, in steps of {step}\nhint: it begins within its limits and widens in steps above 0"
    )]
    Range {
        /// The parameter.
        name: String,
        /// Where it begins.
        from: f64,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
        /// The step.
        step: f64,
    },
}

/// The state of automatic domain randomization: all that it knows, and nothing else.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Adr {
    settings: AdrSettings,
    ranges: Vec<AdrRange>,
}

impl AdrRange {
    /// A range that begins as the one value `origin`, and widens in steps of `step` within `limits`.
    #[must_use]
    pub fn from_value(target: &Target, origin: f64, limits: [f64; 2], step: f64) -> Self {
        let performances = [Vec::new(), Vec::new()];
        Self { name: target.to_string(), low: origin, high: origin, limits, step, origin, performances }
    }

    fn end(&self, end: End) -> f64 {
        match end {
            End::Low => self.low,
            End::High => self.high,
        }
    }
}

impl Adr {
    /// Automatic randomization of `ranges`.
    ///
    /// # Errors
    /// Settings and ranges that make no sense.
    pub fn new(settings: AdrSettings, ranges: Vec<AdrRange>) -> Result<Self, AdrError> {
        let refuse = |expected, found, hint| Err(AdrError::Setting { expected, found, hint });
        let AdrSettings { boundary_probability, buffer, low, high } = settings;
        if !(boundary_probability > 0.0 && boundary_probability <= 1.0) {
            return refuse("a boundary_probability above 0 and up to 1", boundary_probability, "0.5 is usual");
        }
        if buffer == 0 {
            return refuse("a buffer of at least 1 episode", 0.0, "240 is usual");
        }
        if !low.is_finite() || !high.is_finite() || low >= high {
            return refuse("a threshold `low` below `high`", low, "between them a range stays as it is");
        }
        for range in &ranges {
            let AdrRange { name, low, high, limits: [least, most], step, .. } = range;
            let wide = least <= low && low <= high && high <= most && least < most;
            let finite = [*low, *high, *least, *most, *step].iter().all(|v| v.is_finite());
            if !wide || !finite || *step <= 0.0 {
                let name = name.clone();
                return Err(AdrError::Range { name, from: *low, low: *least, high: *most, step: *step });
            }
        }
        Ok(Self { settings, ranges })
    }

    /// The ranges as they are now.
    #[must_use]
    pub fn ranges(&self) -> &[AdrRange] {
        &self.ranges
    }

    /// The values of an episode of an environment: uniform over the ranges, with one parameter at an end in a part of them.
    #[must_use]
    pub fn sample(&self, seed: Seed, environment: u64, episode: u64) -> AdrSample {
        let key = Streams::new(seed.child("adr"), Occasion::Reset).environment(environment, episode);
        let draw = |name: &str| uniform(key, name_key(name));
        let value = |range: &AdrRange| {
            let value = range.low + draw(&range.name) * (range.high - range.low);
            value.clamp(range.low, range.high)
        };
        let mut values: Vec<f64> = self.ranges.iter().map(value).collect();
        let tried = !self.ranges.is_empty() && draw("whether an end is tried") < self.settings.boundary_probability;
        let boundary = tried.then(|| {
            // Of n parameters with two ends each, one of 2 n.
            let count = 2 * self.ranges.len();
            let which = ((draw("which end is tried") * count as f64) as usize).min(count - 1);
            Boundary { parameter: which / 2, end: if which.is_multiple_of(2) { End::Low } else { End::High } }
        });
        if let Some(Boundary { parameter, end }) = boundary {
            values[parameter] = self.ranges[parameter].end(end);
        }
        AdrSample { values, boundary }
    }

    /// Takes in how well an episode went that tried `boundary`: with the last that is needed, the end moves if it should.
    /// Performances that are no number count as nothing.
    pub fn record(&mut self, boundary: Boundary, performance: f64) -> AdrChange {
        let Some(range) = self.ranges.get_mut(boundary.parameter).filter(|_| performance.is_finite()) else {
            return AdrChange::None;
        };
        let of_end = &mut range.performances[boundary.end as usize];
        of_end.push(performance);
        if of_end.len() < self.settings.buffer {
            return AdrChange::None;
        }
        let mean = of_end.iter().sum::<f64>() / of_end.len() as f64;
        of_end.clear();
        let before = range.end(boundary.end);
        let outwards = match mean {
            mean if mean >= self.settings.high => range.step,
            mean if mean <= self.settings.low => -range.step,
            _ => return AdrChange::None,
        };
        match boundary.end {
            End::Low => range.low = (range.low - outwards).clamp(range.limits[0], range.origin),
            End::High => range.high = (range.high + outwards).clamp(range.origin, range.limits[1]),
        }
        match range.end(boundary.end) == before {
            true => AdrChange::None,
            false if outwards > 0.0 => AdrChange::Widened,
            false => AdrChange::Narrowed,
        }
    }

    /// The entropy of the ranges, a mean over parameters [nats]: how far randomization has come; minus infinite where one of them
    /// is still a single value.
    #[must_use]
    pub fn entropy(&self) -> f64 {
        self.ranges.iter().map(|range| (range.high - range.low).ln()).sum::<f64>() / self.ranges.len().max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SETTINGS: AdrSettings = AdrSettings { boundary_probability: 0.5, buffer: 3, low: 1.0, high: 5.0 };

    fn adr() -> Adr {
        let range = |name: &str| AdrRange::from_value(&Target::own(name), 1.0, [0.5, 1.3], 0.2);
        Adr::new(SETTINGS, vec![range("mass"), range("friction")]).unwrap()
    }

    fn told(adr: &mut Adr, end: End, performances: [f64; 3]) -> AdrChange {
        performances.map(|p| adr.record(Boundary { parameter: 0, end }, p))[2]
    }

    #[test]
    fn ends_move_out_where_a_policy_does_well_and_back_where_it_does_not() {
        let mut adr = adr();
        let ends = |adr: &Adr| [adr.ranges()[0].low, adr.ranges()[0].high];
        assert_eq!(adr.record(Boundary { parameter: 0, end: End::High }, 9.0), AdrChange::None, "one is not enough");
        assert_eq!(ends(&adr), [1.0, 1.0]);
        adr.record(Boundary { parameter: 0, end: End::High }, 9.0);
        assert_eq!(adr.record(Boundary { parameter: 0, end: End::High }, 0.0), AdrChange::Widened, "the mean is 6");
        assert_eq!(ends(&adr), [1.0, 1.2]);
        assert_eq!(told(&mut adr, End::High, [5.0; 3]), AdrChange::Widened, "at the threshold");
        assert_eq!(ends(&adr)[1], 1.3, "no further than the limit");
        assert_eq!(told(&mut adr, End::High, [9.0; 3]), AdrChange::None);
        assert_eq!(told(&mut adr, End::High, [3.0; 3]), AdrChange::None, "between the thresholds");
        assert_eq!(told(&mut adr, End::High, [1.0; 3]), AdrChange::Narrowed);
        assert!((ends(&adr)[1] - 1.1).abs() < 1e-12);
        assert_eq!(told(&mut adr, End::High, [0.0; 3]), AdrChange::Narrowed);
        assert_eq!(ends(&adr), [1.0, 1.0], "not past where it began");
        assert_eq!(told(&mut adr, End::Low, [9.0; 3]), AdrChange::Widened);
        assert_eq!(ends(&adr), [0.8, 1.0]);
        assert_eq!(adr.ranges()[1].low, 1.0, "the other stays");
        assert_eq!(told(&mut adr, End::Low, [f64::NAN; 3]), AdrChange::None);
    }

    #[test]
    fn samples_lie_within_and_try_each_end_as_often() {
        let mut adr = adr();
        for parameter in 0..2 {
            for end in [End::Low, End::High] {
                (0..3).for_each(|_| {
                    adr.record(Boundary { parameter, end }, 9.0);
                });
            }
        }
        let mut tried = [0_u32; 4];
        let count = 20_000;
        for environment in 0..count {
            let sample = adr.sample(Seed(4), environment, 0);
            for (value, range) in sample.values.iter().zip(adr.ranges()) {
                assert!((range.low..=range.high).contains(value));
            }
            if let Some(Boundary { parameter, end }) = sample.boundary {
                tried[2 * parameter + end as usize] += 1;
                assert_eq!(sample.values[parameter], adr.ranges()[parameter].end(end));
            }
        }
        // An eighth each, to four standard errors.
        let expected = count as f64 / 8.0;
        assert!(tried.iter().all(|n| (f64::from(*n) - expected).abs() < 4.0 * (expected * 0.875).sqrt()), "{tried:?}");
        assert_eq!(adr.sample(Seed(4), 7, 3), adr.sample(Seed(4), 7, 3));
        assert_ne!(adr.sample(Seed(4), 7, 3).values, adr.sample(Seed(4), 7, 4).values);
    }

    /// A policy that manages whatever is no further than 0.2 from where it was trained: ranges come to that and stay near it.
    #[test]
    fn ranges_come_to_what_a_policy_can_do() {
        let range = AdrRange::from_value(&Target::own("mass"), 1.0, [0.1, 2.0], 0.05);
        let mut adr = Adr::new(SETTINGS, vec![range]).unwrap();
        for episode in 0..5_000 {
            let sample = adr.sample(Seed(9), 0, episode);
            if let Some(boundary) = sample.boundary {
                adr.record(boundary, if (sample.values[0] - 1.0).abs() <= 0.2 + 1e-9 { 10.0 } else { 0.0 });
            }
        }
        let range = &adr.ranges()[0];
        assert!((0.74..=0.81).contains(&range.low) && (1.19..=1.26).contains(&range.high), "{range:?}");
        assert!(adr.entropy().is_finite());
        let text = serde_json::to_string(&adr).unwrap();
        assert_eq!(serde_json::from_str::<Adr>(&text).unwrap(), adr);
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let range = || AdrRange::from_value(&Target::own("mass"), 1.0, [0.5, 1.3], 0.2);
        let refused = |settings: AdrSettings, range: AdrRange, words: &str| {
            let text = Adr::new(settings, vec![range]).unwrap_err().to_string();
            assert!(text.contains(words) && text.contains("\nhint: "), "{text}");
        };
        refused(AdrSettings { boundary_probability: 0.0, ..SETTINGS }, range(), "boundary_probability");
        refused(AdrSettings { buffer: 0, ..SETTINGS }, range(), "buffer");
        refused(AdrSettings { low: 5.0, ..SETTINGS }, range(), "`low` below `high`");
        refused(SETTINGS, AdrRange { step: 0.0, ..range() }, "steps of 0");
        refused(SETTINGS, AdrRange::from_value(&Target::own("mass"), 3.0, [0.5, 1.3], 0.2), "from 3");
    }
}
