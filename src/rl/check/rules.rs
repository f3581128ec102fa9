//! Each line of the contract, as something that is played.

use super::play::{Play, Row, Stale, difference};
use super::{EnvReport, Rule};
use crate::rl::{About, EnvError, Made, Occasion, OptionKind, OptionValue, Options, Threads, VecEnv, Which};

/// What lanes are compared with: their seeds and all that came of them.
pub struct Base {
    about: About,
    rows: Vec<Vec<Row>>,
}

/// The seeds of lanes: neighbours, equal ones, and the largest.
const SEEDS: [u64; 5] = [3, 4, u64::MAX, 0, 4];

type Make<'a> = &'a dyn Fn(usize) -> Made;

fn begin(make: Make<'_>, stale: Stale) -> Result<Play, EnvError> {
    Play::begin(make(SEEDS.len())?, &SEEDS, stale)
}

/// Notes where lanes of `play` differ from lanes of the base, given in pairs.
fn compare(report: &mut EnvReport, rule: Rule, base: &Base, play: &Play, pairs: &[(usize, usize)], how: &str) {
    for (lane, of_base) in pairs {
        if let Some(difference) = difference(&base.about, &base.rows[*of_base], &play.rows[*lane]) {
            report.find(rule, format!("{how}, lane {lane}: {difference}"));
            // Other lanes would say the same.
            return;
        }
    }
}

const ALL: [(usize, usize); 5] = [(0, 0), (1, 1), (2, 2), (3, 3), (4, 4)];

/// Plays what all others are compared with, and looks at what comes of it.
pub fn base(make: Make<'_>, steps: usize, report: &mut EnvReport) -> Result<Base, EnvError> {
    let mut play = begin(make, Stale::High)?;
    let about = play.env.about().clone();
    spaces(&about, report);
    if play.env.lanes() != SEEDS.len() {
        report.find(Rule::About, format!("{} lanes were asked for, and there are {}", SEEDS.len(), play.env.lanes()));
    }
    if *make(1)?.about() != about {
        report.find(Rule::About, "it is another with 1 lane than with 5");
    }
    look(&play, &about, report);
    let mut lengths = [0_u32; SEEDS.len()];
    for _ in 0..steps {
        play.step()?;
        report.steps += SEEDS.len();
        look(&play, &about, report);
        for (lane, length) in lengths.iter_mut().enumerate() {
            *length += 1;
            if about.max_steps.is_some_and(|most| *length > most) {
                report.find(
                    Rule::End,
                    format!("lane {lane}: an episode has {length} steps, of at most {:?}", about.max_steps),
                );
            }
            if play.rows[lane].last().is_some_and(|row| row.over) {
                report.episodes += 1;
                *length = 0;
            }
        }
        play.reset_over()?;
        look(&play, &about, report);
    }
    Ok(Base { about, rows: play.rows })
}

fn spaces(about: &About, report: &mut EnvReport) {
    let mut find = |what: String| report.find(Rule::About, what);
    if let Err(why) = about.observation.check() {
        find(format!("observation: {why}"));
    }
    if let Err(why) = about.action.check() {
        find(format!("action: {why}"));
    }
    let version =
        about.id.rsplit_once("-v").is_some_and(|(name, version)| !name.is_empty() && version.parse::<u32>().is_ok());
    if !version || about.title.trim().is_empty() {
        find(format!("the id `{}` is not NAMESPACE/NAME-vNUMBER, or the title `{}` is empty", about.id, about.title));
    }
    if about.reward_range.0.partial_cmp(&about.reward_range.1).is_none_or(std::cmp::Ordering::is_gt) {
        find(format!("rewards are within {:?}", about.reward_range));
    }
    if about.max_steps == Some(0) || about.seconds_a_step.is_some_and(|s| s.is_nan() || s <= 0.0 || s.is_infinite()) {
        find(format!("episodes of {:?} steps of {:?} s", about.max_steps, about.seconds_a_step));
    }
    let names: Vec<&str> = about.info.iter().chain(&about.privileged).map(|channel| channel.name.as_str()).collect();
    let options: Vec<&str> = about.options.iter().map(|option| option.name.as_str()).collect();
    for names in [names, options] {
        for (k, name) in names.iter().enumerate() {
            if name.is_empty() || names[..k].contains(name) {
                find(format!("a channel or option has no name of its own: `{name}`"));
            }
        }
    }
    for option in &about.options {
        if let Err(error) = option.check(&option.nominal()) {
            find(format!("without being set, {error}"));
        }
    }
}

/// What is observed and rewarded now.
fn look(play: &Play, about: &About, report: &mut EnvReport) {
    if let Some((lane, k)) = about.observation.outside(&play.buffers.observations) {
        let value = play.buffers.observations[lane * about.observation.size() + k];
        let (low, high) = (about.observation.low[k], about.observation.high[k]);
        if !report.findings.iter().any(|finding| finding.rule == Rule::Observation) {
            let name = &about.observation.names[k];
            report.find(Rule::Observation, format!("lane {lane}: `{name}` is {value}, out of [{low}, {high}]"));
        }
    }
    let (low, high) = about.reward_range;
    let bad = |reward: &f64| !(reward.is_finite() && *reward >= low && *reward <= high);
    if let Some(lane) = play.buffers.rewards.iter().position(bad)
        && !report.findings.iter().any(|finding| finding.rule == Rule::Reward)
        // After a reset there is none.
        && play.rows[lane].last().is_some_and(|row| !row.first)
    {
        report.find(Rule::Reward, format!("lane {lane}: {}, out of [{low}, {high}]", play.buffers.rewards[lane]));
    }
}

/// Same seed, same bits: of another environment, of one that has been used, and whatever buffers held before.
pub fn same_seed(make: Make<'_>, steps: usize, base: &Base, report: &mut EnvReport) -> Result<(), EnvError> {
    let mut again = begin(make, Stale::High)?;
    again.run(steps)?;
    compare(report, Rule::Seed, base, &again, &ALL, "another environment of the same seeds");
    let mut used = Play::begin(again.env, &SEEDS, Stale::High)?;
    used.run(steps)?;
    compare(report, Rule::Seed, base, &used, &ALL, "an environment that was used, given its seeds again");
    let mut low = begin(make, Stale::Low)?;
    low.run(steps)?;
    compare(report, Rule::Written, base, &low, &ALL, "with other numbers in the buffers before");
    report.steps += 3 * steps * SEEDS.len();
    Ok(())
}

/// Lanes alone, in another order, and over threads.
pub fn lanes(make: Make<'_>, steps: usize, base: &Base, report: &mut EnvReport) -> Result<(), EnvError> {
    for lane in 0..SEEDS.len() {
        let mut alone = Play::begin(make(1)?, &SEEDS[lane..=lane], Stale::High)?;
        alone.run(steps)?;
        compare(report, Rule::Lanes, base, &alone, &[(0, lane)], &format!("the seed {} alone", SEEDS[lane]));
    }
    let order = [4, 2, 0, 3, 1];
    let mut permuted = Play::begin(make(SEEDS.len())?, &order.map(|lane| SEEDS[lane]), Stale::High)?;
    permuted.run(steps)?;
    let pairs: Vec<(usize, usize)> = order.into_iter().enumerate().collect();
    compare(report, Rule::Lanes, base, &permuted, &pairs, "with lanes in another order");
    for chunks in [2, 3] {
        let threads = Threads::new(SEEDS.len(), chunks, make)?;
        let mut play = Play::begin(Box::new(threads), &SEEDS, Stale::High)?;
        play.run(steps)?;
        compare(report, Rule::Lanes, base, &play, &ALL, &format!("in {chunks} threads"));
    }
    report.steps += 4 * steps * SEEDS.len();
    Ok(())
}

/// A lane reset amid its episode, beside others that are not.
pub fn masks(make: Make<'_>, steps: usize, base: &Base, report: &mut EnvReport) -> Result<(), EnvError> {
    let mut play = begin(make, Stale::High)?;
    let size = base.about.observation.size();
    for step in 0..steps {
        play.step()?;
        play.reset_over()?;
        if step % 7 == 3 {
            let before = play.buffers.observations.clone();
            // Lane 1 with a seed, and at other times lane 3 without.
            let mask: Vec<bool> = (0..SEEDS.len()).map(|lane| lane == if step % 2 == 0 { 1 } else { 3 }).collect();
            let seeds = (step % 2 == 0).then_some([9; SEEDS.len()]);
            play.reset(Which::Mask(&mask), seeds.as_ref().map(|seeds| seeds.as_slice()))?;
            let touched = |lane: &usize| {
                let bits = |row: &[f32]| row.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
                let range = lane * size..(lane + 1) * size;
                !mask[*lane] && bits(&before[range.clone()]) != bits(&play.buffers.observations[range])
            };
            if let Some(lane) = (0..SEEDS.len()).find(touched) {
                report.find(Rule::Mask, format!("a reset of another lane writes what is observed of lane {lane}"));
            }
        }
    }
    compare(report, Rule::Mask, base, &play, &[(0, 0), (2, 2), (4, 4)], "as other lanes are reset");
    let nobody = [false; SEEDS.len()];
    let mut play = begin(make, Stale::High)?;
    play.run(steps / 2)?;
    play.reset(Which::Mask(&nobody), None)?;
    play.run(steps - steps / 2)?;
    compare(report, Rule::Mask, base, &play, &ALL, "after a reset of no lane");
    report.steps += 2 * steps * SEEDS.len();
    Ok(())
}

/// A clone, stepped in turn with what it was taken of.
pub fn clones(make: Make<'_>, steps: usize, base: &Base, report: &mut EnvReport) -> Result<(), EnvError> {
    let mut play = begin(make, Stale::High)?;
    play.run(steps / 2)?;
    let mut clone = play.clone();
    for _ in steps / 2..steps {
        play.run(1)?;
        clone.run(1)?;
    }
    compare(report, Rule::Clone, base, &play, &ALL, "beside a clone");
    compare(report, Rule::Clone, base, &clone, &ALL, "a clone");
    report.steps += 2 * steps * SEEDS.len();
    Ok(())
}

/// A lane copied within a vector, and from another.
pub fn copies(make: Make<'_>, steps: usize, base: &Base, report: &mut EnvReport) -> Result<(), EnvError> {
    let mut play = begin(make, Stale::High)?;
    play.run(steps / 2)?;
    let snapshot = play.clone();
    play.env.copy_lane(0, 3);
    play.act_as(3, &snapshot, 0);
    play.env.copy_lane(2, 2);
    play.run(steps - steps / 2)?;
    compare(report, Rule::Copy, base, &play, &[(3, 0)], "a copy of lane 0 to lane 3");
    compare(report, Rule::Copy, base, &play, &[(0, 0), (1, 1), (2, 2), (4, 4)], "beside a lane that was copied");
    let mut other = Play::begin(make(2)?, &[77, 78], Stale::High)?;
    let mut beside = other.clone();
    other.run(3)?;
    if let Err(error) = other.env.copy_lane_from(&snapshot.env, 2, 0) {
        report.find(Rule::Copy, format!("a lane of another of its kind is refused: {error}"));
    } else {
        other.act_as(0, &snapshot, 2);
        other.run(steps - steps / 2)?;
        beside.run(3 + steps - steps / 2)?;
        compare(report, Rule::Copy, base, &other, &[(0, 2)], "lane 2 copied to an environment of 2 lanes");
        if let Some(difference) = difference(&base.about, &beside.rows[1], &other.rows[1]) {
            report.find(Rule::Copy, format!("beside a lane copied from another environment: {difference}"));
        }
    }
    report.steps += steps * (SEEDS.len() + 2);
    Ok(())
}

/// Lanes that are stepped on after their end.
pub fn ends(make: Make<'_>, steps: usize, base: &Base, report: &mut EnvReport) -> Result<(), EnvError> {
    let mut play = begin(make, Stale::High)?;
    for step in 0..steps {
        if let Err(error) = play.step() {
            report.find(Rule::End, format!("a step of a lane that is over fails: {error}"));
            return Ok(());
        }
        // A lane waits for up to three steps.
        if step % 4 == 3 {
            play.reset_over()?;
        }
    }
    compare(report, Rule::End, base, &play, &ALL, "as lanes that are over are stepped");
    report.steps += steps * SEEDS.len();
    Ok(())
}

/// Options that are not, or have values they cannot have.
pub fn errors(make: Make<'_>, steps: usize, base: &Base, report: &mut EnvReport) -> Result<(), EnvError> {
    let mut bad = vec![("an unknown option".to_owned(), Options::new().with("no_such_option", 1.0))];
    for option in base.about.options.iter().filter(|option| option.at == Occasion::Reset) {
        let value = match &option.kind {
            OptionKind::Number { .. } | OptionKind::Whole { .. } => OptionValue::Number(f64::NAN),
            OptionKind::Switch { .. } => OptionValue::Number(0.5),
            OptionKind::Choice { .. } => OptionValue::Text("no_such_choice".into()),
            OptionKind::Text { .. } => OptionValue::Switch(true),
        };
        bad.push((format!("{value} for the option `{}`", option.name), Options::new().with(&option.name, value)));
    }
    let mut play = begin(make, Stale::High)?;
    play.run(steps / 2)?;
    for (what, options) in &bad {
        let mut observations = play.buffers.observations.clone();
        if play.env.reset(Which::All, None, options, &mut observations).is_ok() {
            report.find(Rule::Error, format!("{what} is taken"));
            return Ok(());
        }
    }
    play.run(steps - steps / 2)?;
    compare(report, Rule::Error, base, &play, &ALL, "after a reset that was refused");
    report.steps += steps * SEEDS.len();
    Ok(())
}
