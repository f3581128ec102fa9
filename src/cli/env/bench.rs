//! `trueup env bench`: how fast environments are.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use serde::Serialize;

use super::super::screen::Screen;
use super::super::stop::{Outcome, Stop};
use super::{entry, refused};
use crate::io::{InputError, RunFile, hint_among};
use crate::market;
use crate::market::env::MarketSetup;
use crate::rl::{
    About, Actions, AutoresetMode, Buffers, Checked, EnvEntry, EnvError, Episode, OptionAbout, OptionKind, OptionValue,
    Options, Space, SplitMix64, StreamName, Threads, VecEnv, Which,
};

/// Measure how fast an environment is: steps a second, with random actions and automatic resets
///
/// All that a learner pays for is in it but for the learner: actions are checked, lanes step, episodes that are over begin anew.
/// Actions are drawn beforehand.
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup env bench CartPole-v0
  trueup env bench trueup/CartPole-v0 --lanes 4096 --threads 2
  trueup env bench Trade-v0 --lanes 1 --set length=500 --json
  trueup env bench Trade-v0 --run data/bars/run.toml --set length=0")]
pub(super) struct Bench {
    /// Environment, as `trueup env list` names it; `trueup/` may be left out
    #[arg(value_name = "ID")]
    id: String,
    /// Environments stepped together
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    lanes: u32,
    /// Run whose market the environment is in: its data, venue, account, and what it draws anew for each episode; of market
    /// environments, which else have generated data
    #[arg(long, value_name = "RUN.toml")]
    run: Option<PathBuf>,
    /// Option of the environment, as NAME=VALUE; may be given more than once
    #[arg(long = "set", value_name = "NAME=VALUE")]
    options: Vec<String>,
    /// Rounds that are timed; the median is told
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1_000))]
    rounds: u32,
    /// Seconds a round
    #[arg(long, value_name = "S", default_value_t = 0.25)]
    seconds: f64,
    /// Print JSON (schema trueup.env_bench/1) instead of a line
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Measured {
    schema: &'static str,
    id: String,
    lanes: usize,
    threads: usize,
    rounds: usize,
    /// Steps of a lane over all rounds.
    steps: u64,
    episodes: u64,
    /// Of the wall clock, for one step of one lane: the median of the rounds, and the least and most.
    ns_per_step: Spread,
    /// Steps of a lane a second, in the median round.
    steps_per_second: f64,
}

#[derive(Serialize)]
struct Spread {
    median: f64,
    least: f64,
    most: f64,
}

/// Rows of actions that are drawn beforehand, and given over and over.
const ROWS: usize = 64;

impl Bench {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let measured = self.measured()?;
        let text = if self.json { format!("{}\n", serde_json::to_string_pretty(&measured)?) } else { told(&measured) };
        screen.print(&text)?;
        Ok(Outcome::Done)
    }

    /// The market of the run that was asked for.
    fn setup(&self, entry: &EnvEntry) -> Result<Option<MarketSetup>, InputError> {
        let Some(path) = &self.run else { return Ok(None) };
        if market::ENVIRONMENTS.iter().all(|known| known.id != entry.id) {
            let message = format!("`{}` is in no market", entry.id);
            return Err(InputError::new("--run", message).hint("`trueup env list` tells which trade"));
        }
        MarketSetup::from_run(&RunFile::read(path)?).map(Some)
    }

    fn measured(&self) -> Result<Measured, InputError> {
        if !(self.seconds > 0.0 && self.seconds <= 60.0) {
            return Err(InputError::new("--seconds", "a round cannot be this long").found(self.seconds).hint("up to 60 s"));
        }
        let entry = entry(&self.id)?;
        let refused = |error: EnvError| refused(entry.id, &error);
        let options = parsed(&self.options, &entry.describe().map_err(refused)?)?;
        let setup = self.setup(entry)?;
        let make = |lanes: usize| match &setup {
            Some(setup) => market::env::make_on(entry.id, lanes, setup.clone(), &options),
            None => (entry.make)(lanes, &options),
        };
        let lanes = self.lanes as usize;
        let threads = rayon::current_num_threads().min(lanes);
        let env: Box<dyn VecEnv> = if threads > 1 {
            Box::new(Threads::new(lanes, threads, make).map_err(refused)?)
        } else {
            make(lanes).map_err(refused)?
        };
        let mut run = Run::begin(env).map_err(refused)?;
        // What is not yet in memory or caches is no part of the speed.
        run.round(self.seconds / 4.0).map_err(refused)?;
        (run.steps, run.episodes) = (0, 0);
        let rounds: Result<Vec<f64>, EnvError> = (0..self.rounds).map(|_| run.round(self.seconds)).collect();
        let mut rounds = rounds.map_err(refused)?;
        rounds.sort_by(f64::total_cmp);
        let median = rounds[rounds.len() / 2];
        Ok(Measured {
            schema: "trueup.env_bench/1",
            id: entry.id.to_owned(),
            lanes,
            threads,
            rounds: rounds.len(),
            steps: run.steps,
            episodes: run.episodes,
            ns_per_step: Spread { median, least: rounds[0], most: rounds[rounds.len() - 1] },
            steps_per_second: 1e9 / median,
        })
    }
}

fn told(measured: &Measured) -> String {
    let Measured { id, lanes, threads, steps, episodes, rounds, ns_per_step: ns, .. } = measured;
    let plural = |count: usize, noun: &str| format!("{count} {noun}{}", if count == 1 { "" } else { "s" });
    format!(
        "{id}: {:.1} ns a step ({:.1} to {:.1} over {rounds} rounds), {:.3} million steps a second\n  \
         {} on {}, {steps} steps, {episodes} episodes\n",
        ns.median,
        ns.least,
        ns.most,
        measured.steps_per_second / 1e6,
        plural(*lanes, "lane"),
        plural(*threads, "thread"),
    )
}

/// An environment that is stepped with actions drawn beforehand.
struct Run {
    env: Checked<Box<dyn VecEnv>>,
    buffers: Buffers,
    continuous: Vec<Vec<f32>>,
    discrete: Vec<Vec<i64>>,
    next: usize,
    steps: u64,
    episodes: u64,
}

impl Run {
    fn begin(env: Box<dyn VecEnv>) -> Result<Self, EnvError> {
        let lanes = env.lanes();
        let mut buffers = Buffers::of(&env);
        let mut actor = Episode::default().stream(StreamName::new("actor"));
        let about = env.about().clone();
        let (mut continuous, mut discrete) = (Vec::new(), Vec::new());
        for _ in 0..ROWS {
            let (mut reals, mut choices) = (Vec::new(), Vec::new());
            (0..lanes).for_each(|_| draw(&about.action, &mut actor, &mut reals, &mut choices));
            continuous.push(reals);
            discrete.push(choices);
        }
        let mut env = Checked::new(env, AutoresetMode::NextStep)?;
        let seeds: Vec<u64> = (0..lanes as u64).collect();
        env.reset(Which::All, Some(&seeds), &Options::new(), &mut buffers.observations)?;
        Ok(Self { env, buffers, continuous, discrete, next: 0, steps: 0, episodes: 0 })
    }

    /// Steps for so many seconds, and gives the nanoseconds a step of a lane.
    fn round(&mut self, seconds: f64) -> Result<f64, EnvError> {
        // The clock is looked at about every 10,000 steps of a lane.
        let lanes = self.env.lanes();
        let batch = (10_000 / lanes).max(1);
        let begin = Instant::now();
        let mut taken = 0_u64;
        loop {
            for _ in 0..batch {
                self.step()?;
            }
            taken += batch as u64 * lanes as u64;
            let passed = begin.elapsed().as_secs_f64();
            if passed >= seconds {
                self.steps += taken;
                return Ok(passed * 1e9 / taken as f64);
            }
        }
    }

    fn step(&mut self) -> Result<(), EnvError> {
        self.next = (self.next + 1) % ROWS;
        let actions = match &self.env.about().action {
            Space::Box(_) => Actions::Continuous(&self.continuous[self.next]),
            Space::Discrete { .. } | Space::MultiDiscrete { .. } => Actions::Discrete(&self.discrete[self.next]),
        };
        self.env.step(actions, &mut self.buffers.out())?;
        self.episodes += self.env.over().iter().filter(|over| **over).count() as u64;
        Ok(())
    }
}

/// An action evenly drawn from the space; within -1 and 1 where that has no bounds.
fn draw(space: &Space, actor: &mut SplitMix64, reals: &mut Vec<f32>, choices: &mut Vec<i64>) {
    match space {
        Space::Box(space) => {
            for (low, high) in space.low.iter().zip(&space.high) {
                let low_end = if low.is_finite() { *low } else { high.min(0.0) - 1.0 };
                let high_end = if high.is_finite() { *high } else { low_end + 2.0 };
                reals.push((actor.between(low_end.into(), high_end.into()) as f32).clamp(*low, *high));
            }
        }
        Space::Discrete { n, .. } => choices.push((actor.uniform() * *n as f64) as i64),
        Space::MultiDiscrete { n, .. } => choices.extend(n.iter().map(|n| (actor.uniform() * *n as f64) as i64)),
    }
}

/// Options as they are written on the command line, by the kinds the environment has them of.
fn parsed(written: &[String], about: &About) -> Result<Options, InputError> {
    let names: Vec<&str> = about.options.iter().map(|option| option.name.as_str()).collect();
    let mut options = Options::new();
    for text in written {
        let bad = |message: &str| InputError::new("--set", message).found_text(text);
        let (name, value) = text.split_once('=').ok_or_else(|| bad("expected NAME=VALUE"))?;
        let Some(option) = about.options.iter().find(|option| option.name == name) else {
            let message = format!("`{}` has no such option", about.id);
            return Err(bad(&message).maybe_hint(hint_among(name, &names)));
        };
        options.set(name, read(option, value).ok_or_else(|| bad("the value cannot be read").hint(&*option.meaning))?);
    }
    Ok(options)
}

fn read(option: &OptionAbout, value: &str) -> Option<OptionValue> {
    Some(match option.kind {
        OptionKind::Number { .. } | OptionKind::Whole { .. } => OptionValue::Number(value.parse().ok()?),
        OptionKind::Switch { .. } => OptionValue::Switch(value.parse().ok()?),
        OptionKind::Choice { .. } | OptionKind::Text { .. } => OptionValue::Text(value.to_owned()),
    })
}
