//! `trueup env`: the environments that learners step.

mod bench;

use clap::{Args, Subcommand};
use serde::Serialize;

use crate::io::{InputError, hint_among};
use crate::report::quantity::number;
use crate::rl::{About, BoxSpace, EnvEntry, EnvError, OptionAbout, OptionKind, Space};
use crate::{market, robot};

use super::screen::Screen;
use super::stop::{Outcome, Stop};

/// List the environments for reinforcement learning, or measure how fast they are
#[derive(Debug, Args)]
pub(super) struct Env {
    #[command(subcommand)]
    command: EnvCommand,
}

#[derive(Debug, Subcommand)]
enum EnvCommand {
    List(List),
    Bench(bench::Bench),
}

/// List the environments: what is observed, what can be done, and what can be set
#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  trueup env list
  trueup env list --json | python3 -m json.tool")]
struct List {
    /// Print JSON (schema trueup.environments/1) instead of a table; a bound that is infinite is null
    #[arg(long)]
    json: bool,
}

impl Env {
    pub fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        match self.command {
            EnvCommand::List(list) => list.run(screen),
            EnvCommand::Bench(bench) => bench.run(screen),
        }
    }
}

/// The environments of all domains.
fn entries() -> impl Iterator<Item = &'static EnvEntry> {
    robot::ENVIRONMENTS.iter().chain(market::ENVIRONMENTS)
}

/// The environment of this id; `trueup/` may be left out.
fn entry(id: &str) -> Result<&'static EnvEntry, InputError> {
    let full = if id.contains('/') { id.to_owned() } else { format!("trueup/{id}") };
    entries().find(|entry| entry.id == full).ok_or_else(|| {
        let ids: Vec<&str> = entries().map(|entry| entry.id).collect();
        InputError::new(id, "there is no environment of this id").maybe_hint(hint_among(&full, &ids))
    })
}

/// What is wrong with an environment, as an error of the command line.
fn refused(id: &str, error: &EnvError) -> InputError {
    let text = error.to_string();
    match text.split_once("\nhint: ") {
        Some((message, hint)) => InputError::new(id, message).hint(hint),
        None => InputError::new(id, text),
    }
}

#[derive(Serialize)]
struct Listing {
    schema: &'static str,
    environments: Vec<Row>,
}

#[derive(Serialize)]
struct Row {
    id: String,
    title: String,
    /// Observations: one row a component.
    observation: Vec<ComponentRow>,
    action: ActionRow,
    reward_range: [Option<f64>; 2],
    /// Seconds a step; null where steps are not equally long.
    seconds_a_step: Option<f64>,
    /// Steps after which an episode is cut off; null where it is not.
    max_steps: Option<u32>,
    info: Vec<ChannelRow>,
    options: Vec<OptionRow>,
}

#[derive(Serialize)]
struct ComponentRow {
    name: String,
    unit: String,
    low: Option<f32>,
    high: Option<f32>,
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
enum ActionRow {
    Box { components: Vec<ComponentRow> },
    Discrete { n: usize, name: String },
    MultiDiscrete { n: Vec<usize>, names: Vec<String> },
}

#[derive(Serialize)]
struct ChannelRow {
    name: String,
    unit: String,
}

#[derive(Serialize)]
struct OptionRow {
    name: String,
    unit: String,
    meaning: String,
    /// Whether it is set when the environment is made, or at a reset.
    at: &'static str,
    kind: &'static str,
    nominal: serde_json::Value,
    lower: Option<f64>,
    upper: Option<f64>,
    choices: Vec<String>,
}

impl List {
    fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        let mut abouts = Vec::new();
        for entry in entries() {
            abouts.push(entry.describe().map_err(|error| Stop::Bug(format!("{}: {error}", entry.id)))?);
        }
        let text = if self.json {
            let listing = Listing { schema: "trueup.environments/1", environments: abouts.iter().map(row).collect() };
            format!("{}\n", serde_json::to_string_pretty(&listing)?)
        } else {
            table(screen, &abouts)
        };
        screen.print(&text)?;
        Ok(Outcome::Done)
    }
}

fn row(about: &About) -> Row {
    let finite = |value: f64| value.is_finite().then_some(value);
    let action = match &about.action {
        Space::Box(space) => ActionRow::Box { components: components(space) },
        Space::Discrete { n, name } => ActionRow::Discrete { n: *n, name: name.clone() },
        Space::MultiDiscrete { n, names } => ActionRow::MultiDiscrete { n: n.clone(), names: names.clone() },
    };
    let channel = |channel: &crate::rl::InfoChannel| ChannelRow { name: channel.name.clone(), unit: channel.unit.clone() };
    Row {
        id: about.id.clone(),
        title: about.title.clone(),
        observation: components(&about.observation),
        action,
        reward_range: [finite(about.reward_range.0), finite(about.reward_range.1)],
        seconds_a_step: about.seconds_a_step,
        max_steps: about.max_steps,
        info: about.info.iter().map(channel).collect(),
        options: about.options.iter().map(option).collect(),
    }
}

fn components(space: &BoxSpace) -> Vec<ComponentRow> {
    let finite = |value: f32| value.is_finite().then_some(value);
    (0..space.size())
        .map(|k| ComponentRow {
            name: space.names[k].clone(),
            unit: space.units[k].clone(),
            low: finite(space.low[k]),
            high: finite(space.high[k]),
        })
        .collect()
}

fn option(option: &OptionAbout) -> OptionRow {
    let finite = |value: f64| value.is_finite().then_some(value);
    let number = |value: f64| serde_json::Value::from(value);
    let (kind, nominal, lower, upper, choices) = match &option.kind {
        OptionKind::Number { nominal, lower, upper } => {
            ("number", number(*nominal), finite(*lower), finite(*upper), Vec::new())
        }
        OptionKind::Whole { nominal, lower, upper } => {
            ("whole", (*nominal).into(), Some(*lower as f64), Some(*upper as f64), Vec::new())
        }
        OptionKind::Switch { nominal } => ("switch", (*nominal).into(), None, None, Vec::new()),
        OptionKind::Choice { nominal, of } => ("choice", nominal.as_str().into(), None, None, of.clone()),
        OptionKind::Text { nominal } => ("text", nominal.as_str().into(), None, None, Vec::new()),
    };
    let at = match option.at {
        crate::rl::Occasion::Make => "make",
        crate::rl::Occasion::Reset => "reset",
    };
    let OptionAbout { name, unit, meaning, .. } = option.clone();
    OptionRow { name, unit, meaning, at, kind, nominal, lower, upper, choices }
}

fn table(screen: &Screen, abouts: &[About]) -> String {
    let mut table = screen.table(["environment", "what has to be done", "actions", "observed", "options"]);
    for about in abouts {
        let actions = match &about.action {
            Space::Box(space) => told(space),
            Space::Discrete { n, name } => format!("{name}: 1 of {n}"),
            Space::MultiDiscrete { n, names } => {
                let each = names.iter().zip(n).map(|(name, n)| format!("{name}: 1 of {n}"));
                each.collect::<Vec<_>>().join(", ")
            }
        };
        let options: Vec<&str> = about.options.iter().map(|option| option.name.as_str()).collect();
        table.add_row([about.id.clone(), about.title.clone(), actions, told(&about.observation), options.join(", ")]);
    }
    format!("{}\n", table.trim_fmt())
}

/// Components: names, units and bounds. Of many, the first and the last.
fn told(space: &BoxSpace) -> String {
    const SHOWN: usize = 8;
    let one = |k: usize| {
        let unit = if space.units[k].is_empty() { String::new() } else { format!(" [{}]", space.units[k]) };
        let bounds = match (space.low[k].is_finite(), space.high[k].is_finite()) {
            (false, false) => String::new(),
            _ => format!(" {} to {}", number(space.low[k].into()), number(space.high[k].into())),
        };
        format!("{}{unit}{bounds}", space.names[k])
    };
    let size = space.size();
    if size <= SHOWN {
        return (0..size).map(one).collect::<Vec<_>>().join(", ");
    }
    let first: Vec<String> = (0..SHOWN - 1).map(one).collect();
    format!("{}, and {} more to {}", first.join(", "), size - SHOWN, one(size - 1))
}
