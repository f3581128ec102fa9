//! `check_env` passes what keeps the contract, alone and in every wrapper, and finds each fault that is planted.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may stop where it fails")]

use trueup::rl::wrapper::{
    ActionLatency, ActionScale, ClipActions, Dropout, EpisodeStatistics, ForbiddenZone, Intervention, Latency, Lost,
    ObservationLatency, ObservationNoise, RateLimit, Recorder, Redraw, Smoothing, ZoneOf,
};
use trueup::rl::{
    About, Actions, BoxSpace, Each, Env, EnvError, Episode, Episodes, InfoChannel, Made, Occasion, OptionAbout, Options,
    Out, Rule, Space, SplitMix64, Step, StreamName, Threads, TimeLimit, VecEnv, Which, Wrap, alike, check_env,
};

/// What is wrong with a [`Drift`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fault {
    None,
    Bounds,
    OtherAlone,
    TooLarge,
    RewardTooLarge,
    RewardNan,
    RewardNotWritten,
    EndNotWritten,
    InfoNotWritten,
    ResetNotWritten,
    SharedStream,
    PlaceInStream,
    MaskIgnored,
    MaskWrites,
    MaskAdvancesAll,
    SharedClone,
    SeedKeepsState,
    CopyForgetsStream,
    CopyForgetsEpisode,
    CopyTouchesNext,
    CopyFromRefused,
    OverFails,
    OverDisturbs,
    OverCounts,
    EndTooLate,
    OptionsIgnored,
    ErrorResets,
}

const NOISE: StreamName = StreamName::new("noise");

/// A point that drifts, lanes side by side, with at most one fault.
#[derive(Debug)]
struct Drift {
    fault: Fault,
    about: About,
    positions: Vec<f32>,
    taken: Vec<u32>,
    over: Vec<bool>,
    streams: Vec<SplitMix64>,
    episodes: Episodes,
    shared: std::sync::Arc<std::sync::atomic::AtomicU32>,
}

impl Clone for Drift {
    fn clone(&self) -> Self {
        let shared = if self.fault == Fault::SharedClone { self.shared.clone() } else { Default::default() };
        let Self { fault, about, positions, taken, over, streams, episodes, .. } = self;
        Self {
            fault: *fault,
            about: about.clone(),
            positions: positions.clone(),
            taken: taken.clone(),
            over: over.clone(),
            streams: streams.clone(),
            episodes: episodes.clone(),
            shared,
        }
    }
}

impl Drift {
    fn new(lanes: usize, fault: Fault) -> Self {
        let high = if fault == Fault::Bounds { -5.0 } else { 4.0 };
        let observation = BoxSpace::of(&[("position", "m", -4.0, high), ("steps", "", 0.0, 40.0)]);
        let action = Space::Box(BoxSpace::of(&[("push", "N", -1.0, 1.0)]));
        let mut about = About::new("test/Drift-v0", "Stay", observation, action);
        if fault == Fault::OtherAlone && lanes == 1 {
            about.title = "Stay alone".into();
        }
        about.reward_range = (-16.0, 0.0);
        about.seconds_a_step = Some(0.1);
        about.max_steps = Some(30);
        about.info = vec![InfoChannel::new("taken", "steps")];
        about.privileged = vec![InfoChannel::new("number", "")];
        about.options = vec![OptionAbout::number(Occasion::Reset, "start", "m", [0.0, -1.0, 1.0], "where it begins")];
        Self {
            fault,
            about,
            positions: vec![0.0; lanes],
            taken: vec![0; lanes],
            over: vec![true; lanes],
            streams: vec![Episode::default().stream(NOISE); lanes],
            episodes: Episodes::new(lanes),
            shared: Default::default(),
        }
    }

    fn observe(&self, lane: usize, observations: &mut [f32]) {
        let large = self.fault == Fault::TooLarge && self.taken[lane] == 5;
        observations[2 * lane] = if large { f32::INFINITY } else { self.positions[lane] };
        observations[2 * lane + 1] = self.taken[lane] as f32;
    }

    fn begin(&mut self, lane: usize, start: Option<f32>) {
        let episode = self.episodes.lane(lane);
        let mut stream = episode.stream(NOISE);
        if self.fault == Fault::PlaceInStream {
            stream = Episode { seed: episode.seed ^ (lane as u64 % 2), ..episode }.stream(NOISE);
        }
        if self.fault != Fault::SeedKeepsState || self.taken[lane] == 0 {
            self.streams[lane] = stream;
        }
        self.positions[lane] = start.unwrap_or(self.streams[lane].between(-0.5, 0.5) as f32);
        (self.taken[lane], self.over[lane]) = (0, false);
    }

    fn copy(&mut self, other: &Self, from: usize, to: usize) {
        self.positions[to] = other.positions[from];
        self.taken[to] = other.taken[from];
        self.over[to] = other.over[from];
        if self.fault != Fault::CopyForgetsStream {
            self.streams[to] = other.streams[from];
        }
        if self.fault != Fault::CopyForgetsEpisode {
            self.episodes.copy_lane_from(&other.episodes, from, to);
        }
        if self.fault == Fault::CopyTouchesNext {
            let next = (to + 1) % self.positions.len();
            self.positions[next] += 0.125;
        }
    }
}

impl VecEnv for Drift {
    fn about(&self) -> &About {
        &self.about
    }

    fn lanes(&self) -> usize {
        self.positions.len()
    }

    fn reset(
        &mut self,
        which: Which<'_>,
        seeds: Option<&[u64]>,
        options: &Options,
        observations: &mut [f32],
    ) -> Result<(), EnvError> {
        if self.fault == Fault::ErrorResets {
            self.positions.fill(0.0);
        }
        if self.fault != Fault::OptionsIgnored {
            options.check(&self.about.id, &self.about.options, Occasion::Reset)?;
        }
        let start = options.get("start").map(|_| options.number(&self.about.options, "start")).transpose();
        let start = if self.fault == Fault::OptionsIgnored { None } else { start?.map(|start| start as f32) };
        let which = if self.fault == Fault::MaskIgnored && which.any() { Which::All } else { which };
        self.episodes.begin(which, seeds);
        for lane in which.iter(self.lanes()) {
            self.begin(lane, start);
            if self.fault != Fault::ResetNotWritten {
                self.observe(lane, observations);
            } else {
                observations[2 * lane] = self.positions[lane];
            }
        }
        match self.fault {
            Fault::MaskWrites => observations[1] = 0.0,
            Fault::MaskAdvancesAll => self.streams.iter_mut().for_each(|stream| {
                stream.bits();
            }),
            _ => {}
        }
        Ok(())
    }

    fn step(&mut self, actions: Actions<'_>, out: &mut Out<'_>) -> Result<(), EnvError> {
        let disturbed = self.fault == Fault::OverDisturbs && self.over.contains(&true);
        for (lane, push) in actions.continuous().iter().enumerate() {
            if self.over[lane] {
                match self.fault {
                    Fault::OverFails => return Err(EnvError::Failed { lane, why: "it is over\nhint: stop".into() }),
                    // The next episode is another for what was done after the end of this.
                    Fault::OverCounts => {
                        self.episodes.begin(Which::Mask(&(0..self.over.len()).map(|k| k == lane).collect::<Vec<_>>()), None)
                    }
                    _ => {}
                }
                continue;
            }
            let stream = if self.fault == Fault::SharedStream { 0 } else { lane };
            let mut shake = self.streams[stream].between(-0.3, 0.3) as f32;
            if self.fault == Fault::SharedClone {
                shake += self.shared.fetch_add(1, std::sync::atomic::Ordering::Relaxed) as f32 * 1e-6;
            }
            if disturbed {
                shake += 0.01;
            }
            self.positions[lane] = (self.positions[lane] + 0.3 * push + shake).clamp(-4.0, 4.0);
            self.taken[lane] += 1;
            self.observe(lane, out.observations);
            let late = if self.fault == Fault::EndTooLate { 33 } else { 30 };
            let (terminated, truncated) = (self.positions[lane].abs() > 1.5, self.taken[lane] >= late);
            self.over[lane] = terminated || truncated;
            out.terminated[lane] = terminated && self.fault != Fault::EndTooLate;
            self.over[lane] &= out.terminated[lane] || truncated;
            if self.fault != Fault::EndNotWritten || truncated {
                out.truncated[lane] = truncated;
            }
            out.rewards[lane] = match self.fault {
                Fault::RewardTooLarge => 1.0,
                Fault::RewardNan if self.taken[lane] == 7 => f64::NAN,
                Fault::RewardNotWritten if self.taken[lane] == 7 => continue,
                _ => -f64::from(self.positions[lane]).powi(2),
            };
        }
        Ok(())
    }

    fn info(&self, _: usize, values: &mut [f64]) {
        let skipped = usize::from(self.fault == Fault::InfoNotWritten);
        values.iter_mut().zip(&self.taken).skip(skipped).for_each(|(value, taken)| *value = (*taken).into());
    }

    fn privileged(&self, _: usize, values: &mut [f64]) {
        values.iter_mut().enumerate().for_each(|(lane, value)| *value = self.episodes.lane(lane).number as f64);
    }

    fn copy_lane(&mut self, from: usize, to: usize) {
        let source = self.clone();
        self.copy(&source, from, to);
    }

    fn copy_lane_from(&mut self, other: &dyn VecEnv, from: usize, to: usize) -> Result<(), EnvError> {
        let other: &Self = alike(self, other)?;
        if self.fault == Fault::CopyFromRefused {
            return Err(EnvError::Unlike { id: self.about.id.clone(), why: "it is another".into() });
        }
        self.copy(other, from, to);
        Ok(())
    }
}

fn found(fault: Fault) -> Vec<(Rule, String)> {
    let report = check_env(|lanes| Ok(Box::new(Drift::new(lanes, fault))), 200).unwrap();
    assert!(report.episodes > 20 || fault == Fault::EndTooLate, "{report}");
    report.findings.into_iter().map(|finding| (finding.rule, finding.what)).collect()
}

#[test]
fn what_keeps_the_contract_passes() {
    assert_eq!(found(Fault::None), []);
}

/// The fault, the rule that it breaks, and a part of what is said of it.
const PLANTED: &[(Fault, Rule, &str)] = &[
    (Fault::Bounds, Rule::About, "`position` has bounds [-4, -5]"),
    (Fault::OtherAlone, Rule::About, "another with 1 lane"),
    (Fault::TooLarge, Rule::Observation, "`position` is inf, out of [-4, 4]"),
    (Fault::RewardTooLarge, Rule::Reward, "1, out of [-16, 0]"),
    (Fault::RewardNan, Rule::Reward, "NaN, out of"),
    (Fault::RewardNotWritten, Rule::Written, "the reward is NaN or -12345"),
    (Fault::EndNotWritten, Rule::Written, "`truncated` is 1 or 0"),
    (Fault::InfoNotWritten, Rule::Written, "`taken` is NaN or -12345"),
    (Fault::ResetNotWritten, Rule::Written, "`steps` is"),
    (Fault::SharedStream, Rule::Lanes, "the seed"),
    (Fault::PlaceInStream, Rule::Lanes, "lanes in another order"),
    (Fault::MaskIgnored, Rule::Mask, "as other lanes are reset"),
    (Fault::MaskWrites, Rule::Mask, "writes what is observed of lane 0"),
    (Fault::MaskAdvancesAll, Rule::Mask, "as other lanes are reset"),
    (Fault::SharedClone, Rule::Clone, "beside a clone"),
    (Fault::SeedKeepsState, Rule::Seed, "an environment that was used"),
    (Fault::CopyForgetsStream, Rule::Copy, "a copy of lane 0 to lane 3"),
    (Fault::CopyForgetsEpisode, Rule::Copy, "a copy of lane 0 to lane 3"),
    (Fault::CopyTouchesNext, Rule::Copy, "beside a lane that was copied"),
    (Fault::CopyFromRefused, Rule::Copy, "is refused"),
    (Fault::OverFails, Rule::End, "a step of a lane that is over fails: lane"),
    (Fault::OverDisturbs, Rule::End, "as lanes that are over are stepped"),
    (Fault::OverCounts, Rule::End, "as lanes that are over are stepped"),
    (Fault::EndTooLate, Rule::End, "of at most Some(30)"),
    (Fault::OptionsIgnored, Rule::Error, "an unknown option is taken"),
    (Fault::ErrorResets, Rule::Error, "after a reset that was refused"),
];

#[test]
fn every_planted_fault_is_found_by_its_rule() {
    for (fault, rule, part) in PLANTED {
        let findings = found(*fault);
        assert!(findings.iter().any(|(found, what)| found == rule && what.contains(part)), "{fault:?}: {findings:#?}");
    }
    // No fault is left out.
    assert_eq!(PLANTED.len(), Fault::ErrorResets as usize);
}

#[test]
fn a_report_says_all_that_was_found() {
    let report = check_env(|lanes| Ok(Box::new(Drift::new(lanes, Fault::RewardTooLarge))), 50).unwrap();
    assert!(!report.passed());
    let text = report.to_string();
    assert!(text.starts_with("test/Drift-v0: 1 findings in "), "{text}");
    assert!(text.ends_with("\n  Reward: lane 0: 1, out of [-16, 0]"), "{text}");
    let error = check_env(|_| Err(EnvError::NoLanes), 50).unwrap_err();
    assert!(matches!(error, EnvError::NoLanes));
}

/// A counter of one lane, for [`Each`].
#[derive(Debug, Clone)]
struct Counter {
    about: About,
    count: i64,
    stream: SplitMix64,
}

impl Counter {
    fn new() -> Self {
        let observation = BoxSpace::of(&[("count", "", -4.0, 4.0)]);
        let action = Space::MultiDiscrete { n: vec![3, 2], names: vec!["way".into(), "twice".into()] };
        let about = About::new("test/Counter-v0", "Count up", observation, action);
        Self { about, count: 0, stream: Episode::default().stream(NOISE) }
    }
}

impl Env for Counter {
    fn about(&self) -> &About {
        &self.about
    }

    fn reset(&mut self, episode: Episode, options: &Options, observation: &mut [f32]) -> Result<(), EnvError> {
        options.check(&self.about.id, &self.about.options, Occasion::Reset)?;
        (self.stream, self.count) = (episode.stream(NOISE), 0);
        observation[0] = 0.0;
        Ok(())
    }

    fn step(&mut self, action: Actions<'_>, observation: &mut [f32]) -> Result<Step, EnvError> {
        let [way, twice] = action.discrete() else {
            return Err(EnvError::Failed { lane: 0, why: "two choices make an action\nhint: give both".into() });
        };
        let luck = i64::from(self.stream.uniform() < 0.5);
        self.count = (self.count + (way - 1) * (1 + twice) + luck).clamp(-4, 4);
        observation[0] = self.count as f32;
        Ok(Step { reward: self.count as f64, terminated: self.count.abs() == 4, truncated: false })
    }
}

fn passes(make: impl Fn(usize) -> Made) {
    let report = check_env(make, 150).unwrap();
    assert!(report.passed(), "{report}");
}

fn drift(lanes: usize) -> Drift {
    Drift::new(lanes, Fault::None)
}

#[test]
fn lanes_of_single_environments_keep_the_contract() {
    passes(|lanes| Ok(Box::new(Each::new(Counter::new(), lanes)?)));
    passes(|lanes| Ok(Box::new(Each::new(Counter::new(), lanes)?.with(TimeLimit::new(7))?.with(Recorder::new())?)));
    passes(|lanes| Ok(Box::new(ActionLatency::new(Each::new(Counter::new(), lanes)?, Latency::steps_between(0, 3))?)));
}

#[test]
fn every_wrapper_keeps_the_contract() {
    passes(|lanes| Ok(Box::new(drift(lanes).with(TimeLimit::new(9))?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(ClipActions::new())?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(RateLimit::per_second(&[3.0]))?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(Smoothing::by_time_constant(0.3))?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(ActionScale::new(&[0.5, 1.0]))?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(ObservationNoise::new(&[0.1, 0.0]))?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(Dropout::of_messages(0.3))?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(Dropout::of_components(0.3).showing(Lost::Zero))?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(EpisodeStatistics::new().observing())?)));
    passes(|lanes| Ok(Box::new(drift(lanes).with(Recorder::new())?)));
    for then in [Intervention::Clip, Intervention::Project, Intervention::Penalize(1.0), Intervention::Terminate] {
        passes(|lanes| {
            let zone = ForbiddenZone::new(ZoneOf::Action("push".into()), 0.2, 0.4, then);
            Ok(Box::new(drift(lanes).with(zone)?))
        });
    }
    passes(|lanes| {
        let zone = ForbiddenZone::new(ZoneOf::Observation("position".into()), 1.0, 2.0, Intervention::Terminate);
        Ok(Box::new(drift(lanes).with(zone)?))
    });
}

#[test]
fn every_latency_keeps_the_contract() {
    let latencies = [
        Latency::steps(0),
        Latency::steps(3),
        Latency::steps_between(0, 4),
        Latency::steps_between(1, 4).drawn(Redraw::Episode),
        Latency::seconds(0.13, 0.0),
        Latency::seconds(0.13, 0.12),
        Latency::seconds(0.13, 0.12).drawn(Redraw::Episode),
    ];
    for latency in latencies {
        passes(|lanes| Ok(Box::new(drift(lanes).with(ObservationLatency::new(latency))?)));
        passes(|lanes| Ok(Box::new(ActionLatency::new(drift(lanes), latency)?)));
    }
}

#[test]
fn wrappers_in_a_pile_over_threads_keep_the_contract() {
    let pile = |lanes: usize| -> Made {
        let late = ActionLatency::new(drift(lanes), Latency::seconds(0.1, 0.05))?;
        let env = late
            .with(Smoothing::by_weight(0.5))?
            .with(ActionScale::new(&[0.5, 1.0]))?
            .with(ObservationNoise::new(&[0.1]).named("encoder"))?
            .with(ObservationLatency::new(Latency::steps_between(0, 2)))?
            .with(Dropout::of_messages(0.1))?
            .with(TimeLimit::new(20))?
            .with(EpisodeStatistics::new())?;
        Ok(Box::new(env))
    };
    passes(pile);
    passes(|lanes| Ok(Box::new(Threads::new(lanes, 2, pile)?)));
    passes(|lanes| Ok(Box::new(pile(lanes)?.with(ClipActions::new())?.with(Recorder::new())?)));
}
