//! Episodes that were recorded, as files.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test may stop where it fails")]
#![cfg(feature = "io")]

use std::fs;
use std::path::Path;

use trueup::io::{
    ActionColumns, EpisodeColumns, EpisodeFile, OutputTable, Overwrite, SpaceColumns, Values, write_minari, write_table,
};
use trueup::rl::wrapper::{Recorded, RecordedActions, Recorder};
use trueup::rl::{
    About, Actions, Autoreset, AutoresetMode, BoxSpace, Buffers, Each, Env, EnvError, Episode, Options, Space, Step,
    StreamName, TimeLimit, VecEnv, Which, Wrap,
};

/// A counter that begins anywhere; its actions are of any kind.
#[derive(Debug, Clone)]
struct Counter {
    about: About,
    count: f64,
}

impl Env for Counter {
    fn about(&self) -> &About {
        &self.about
    }

    fn reset(&mut self, episode: Episode, _: &Options, observation: &mut [f32]) -> Result<(), EnvError> {
        self.count = episode.stream(StreamName::new("start")).uniform();
        observation.copy_from_slice(&[self.count as f32, 0.5]);
        Ok(())
    }

    fn step(&mut self, action: Actions<'_>, observation: &mut [f32]) -> Result<Step, EnvError> {
        self.count += match action {
            Actions::Continuous(values) => values.iter().map(|v| f64::from(*v)).sum::<f64>(),
            Actions::Discrete(values) => values.iter().sum::<i64>() as f64,
        };
        observation.copy_from_slice(&[self.count as f32, -0.5]);
        Ok(Step { reward: self.count, terminated: self.count > 3.0, truncated: false })
    }
}

/// Two lanes, each given the actions of `rows` over and over until four episodes have ended.
fn recorded(action: Space, rows: &[Actions<'_>]) -> (About, Vec<Recorded>) {
    let observation = BoxSpace::of(&[("count", "", f32::NEG_INFINITY, f32::INFINITY), ("half", "", -0.5, 0.5)]);
    let env = Counter { about: About::new("test/Counter-v0", "Count", observation, action), count: 0.0 };
    let env = Each::new(env, 2).unwrap().with(TimeLimit::new(3)).unwrap().with(Recorder::new()).unwrap();
    let mut env = Autoreset::new(env, AutoresetMode::NextStep);
    let mut buffers = Buffers::of(env.env());
    env.reset(Which::All, Some(&[7, u64::MAX]), &Options::new(), &mut buffers.observations).unwrap();
    let mut ended = Vec::new();
    for row in rows.iter().cycle() {
        env.step(*row, &mut buffers.out()).unwrap();
        ended.extend(env.env_mut().layer_mut().take());
        if ended.len() >= 4 {
            break;
        }
    }
    (env.env().about().clone(), ended)
}

fn space(space: &Space) -> SpaceColumns {
    match space {
        Space::Box(space) => boxed(space),
        Space::Discrete { n, name } => SpaceColumns::Discrete { n: *n, name: name.clone() },
        Space::MultiDiscrete { n, names } => SpaceColumns::MultiDiscrete { n: n.clone(), names: names.clone() },
    }
}

fn boxed(space: &BoxSpace) -> SpaceColumns {
    let BoxSpace { low, high, shape, names, .. } = space.clone();
    SpaceColumns::Box { low, high, shape, names }
}

fn file<'a>(about: &'a About, episodes: &'a [Recorded]) -> EpisodeFile<'a> {
    let columns = |one: &'a Recorded| EpisodeColumns {
        seed: one.episode.seed,
        number: one.episode.number,
        observations: &one.observations,
        actions: match &one.actions {
            RecordedActions::Continuous(values) => ActionColumns::Continuous(values),
            RecordedActions::Discrete(values) => ActionColumns::Discrete(values),
        },
        rewards: &one.rewards,
        terminated: &one.terminated,
        truncated: &one.truncated,
    };
    EpisodeFile {
        environment: &about.id,
        observation: boxed(&about.observation),
        action: space(&about.action),
        episodes: episodes.iter().map(columns).collect(),
    }
}

fn pushes() -> (About, Vec<Recorded>) {
    let action = Space::Box(BoxSpace::of(&[("left", "N", 0.0, 4.0), ("right", "N", 0.0, 4.0)]));
    recorded(action, &[Actions::Continuous(&[0.25, 0.5, 2.0, 4.0]), Actions::Continuous(&[0.0, 0.0, 0.0, 0.125])])
}

fn choices() -> (About, Vec<Recorded>) {
    recorded(Space::Discrete { n: 3, name: "up".into() }, &[Actions::Discrete(&[0, 2]), Actions::Discrete(&[1, 2])])
}

fn several() -> (About, Vec<Recorded>) {
    let action = Space::MultiDiscrete { n: vec![3, 2], names: vec!["up".into(), "more".into()] };
    recorded(action, &[Actions::Discrete(&[0, 1, 2, 1]), Actions::Discrete(&[1, 0, 2, 0])])
}

fn column(table: &OutputTable, name: &str) -> Vec<Option<f64>> {
    match &table.columns().iter().find(|(other, _)| other == name).unwrap().1 {
        Values::Floats(values) => values.clone(),
        Values::Integers(values) => values.iter().map(|value| value.map(|value| value as f64)).collect(),
        Values::Texts(_) | Values::Times(_) => panic!("{name} is no column of numbers"),
    }
}

#[test]
fn a_table_has_a_row_for_each_observation() {
    let (about, episodes) = pushes();
    let file = file(&about, &episodes);
    let table = file.table(Path::new("steps.parquet")).unwrap();
    let names: Vec<&str> = table.columns().iter().map(|(name, _)| name.as_str()).collect();
    let expected =
        "episode step seed number observation.count observation.half action.left action.right reward terminated truncated";
    assert_eq!(names, expected.split(' ').collect::<Vec<_>>());
    let rows: usize = episodes.iter().map(|one| one.steps() + 1).sum();
    assert_eq!(column(&table, "step").len(), rows);
    // The first to end is lane 1's, at its first step.
    assert_eq!(column(&table, "action.left")[..2], [Some(2.0), None]);
    assert_eq!(column(&table, "terminated")[..2], [Some(1.0), None]);
    assert_eq!(column(&table, "observation.half")[..3], [Some(0.5), Some(-0.5), Some(0.5)]);
    let counts = column(&table, "observation.count");
    // In single precision.
    assert!((counts[1].unwrap() - counts[0].unwrap() - 6.0).abs() < 1e-6);
    let Values::Texts(seeds) = &table.columns()[2].1 else { panic!("seeds are texts") };
    assert_eq!(seeds[0].as_deref(), Some("18446744073709551615"));
    let folder = tempfile::tempdir().unwrap();
    write_table(folder.path().join("steps.parquet"), &table, Overwrite::Refuse).unwrap();
    assert_eq!(fs::read(folder.path().join("steps.parquet")).unwrap()[..4], *b"PAR1");
}

#[test]
fn choices_are_whole_numbers_in_a_table() {
    let (about, episodes) = choices();
    let table = file(&about, &episodes).table(Path::new("steps.csv")).unwrap();
    assert!(matches!(table.columns().iter().find(|(name, _)| name == "action.up").unwrap().1, Values::Integers(_)));
    let (about, episodes) = several();
    let table = file(&about, &episodes).table(Path::new("steps.csv")).unwrap();
    assert_eq!(column(&table, "action.more")[0], Some(1.0));
}

#[test]
fn a_data_set_of_minari_is_whole_and_says_what_it_holds() {
    for (about, episodes) in [pushes(), choices(), several()] {
        let root = tempfile::tempdir().unwrap();
        let file = file(&about, &episodes);
        write_minari(root.path(), "trueup/counter/test-v0", &file, Overwrite::Refuse).unwrap();
        let data = root.path().join("trueup/counter/test-v0/data");
        let json = |name: &str| -> serde_json::Value {
            serde_json::from_str(&fs::read_to_string(data.join(name)).unwrap()).unwrap()
        };
        let metadata = json("metadata.json");
        assert_eq!(metadata["total_episodes"], 4);
        assert_eq!(metadata["total_steps"], file.steps());
        assert_eq!(metadata["data_format"], "arrow");
        let text = metadata["observation_space"].as_str().unwrap();
        assert!(text.contains("\"low\": [-Infinity, -0.5], \"high\": [Infinity, 0.5]"), "{text}");
        assert_eq!(json("0/metadata.json")["seed"], u64::MAX);
        assert_eq!(json("1/metadata.json").get("seed").is_some(), episodes[1].episode.number == 0);
        for (k, episode) in episodes.iter().enumerate() {
            assert_eq!(json(&format!("{k}/metadata.json"))["total_steps"], episode.steps());
            assert_eq!(fs::read(data.join(format!("{k}/part-0.arrow"))).unwrap()[..6], *b"ARROW1");
        }
        let left: Vec<_> = fs::read_dir(root.path().join("trueup/counter")).unwrap().collect();
        assert_eq!(left.len(), 1);
    }
}

#[test]
fn nothing_is_written_over_unasked_and_bad_ids_and_columns_are_refused() {
    let (about, episodes) = pushes();
    let root = tempfile::tempdir().unwrap();
    let write = |id: &str, file: &EpisodeFile<'_>, overwrite| write_minari(root.path(), id, file, overwrite);
    let good = file(&about, &episodes);
    write("a-v0", &good, Overwrite::Refuse).unwrap();
    let error = write("a-v0", &good, Overwrite::Refuse).unwrap_err().to_string();
    assert!(error.contains("exists already"), "{error}");
    let one = EpisodeFile { episodes: good.episodes[..1].to_vec(), ..good.clone() };
    write("a-v0", &one, Overwrite::Force).unwrap();
    assert!(!root.path().join("a-v0/data/1").exists());
    for id in ["", "a", "a-v", "../a-v0", "a b-v0", "/a-v0", "a/-v0", "a//b-v0"] {
        let error = write(id, &good, Overwrite::Refuse).unwrap_err().to_string();
        assert!(error.contains("Minari takes no data set of this id"), "{id}: {error}");
    }
    let none = EpisodeFile { episodes: Vec::new(), ..good.clone() };
    assert!(write("b-v0", &none, Overwrite::Refuse).unwrap_err().to_string().contains("no episode"));
    let mut short = good.clone();
    short.episodes[1].rewards = &short.episodes[1].rewards[1..];
    let error = write("b-v0", &short, Overwrite::Refuse).unwrap_err().to_string();
    assert!(error.contains("the columns of episode 1") && error.contains("hint"), "{error}");
    assert!(short.table(Path::new("x.csv")).is_err());
    let steps = 131_072;
    let (observations, actions) = (vec![0.0; 2 * (steps + 1)], vec![0.0; 2 * steps]);
    let (rewards, flags) = (vec![0.0; steps], vec![false; steps]);
    let long = EpisodeColumns {
        seed: 1,
        number: 0,
        observations: &observations,
        actions: ActionColumns::Continuous(&actions),
        rewards: &rewards,
        terminated: &flags,
        truncated: &flags,
    };
    let long = EpisodeFile { episodes: vec![good.episodes[0], long], ..good.clone() };
    let error = write("b-v0", &long, Overwrite::Refuse).unwrap_err().to_string();
    assert!(error.contains("no more than 131071 steps of an episode, found 131072 steps of episode 1"), "{error}");
    let mut other = good;
    other.episodes[0].actions = ActionColumns::Discrete(&[1, 2]);
    assert!(other.table(Path::new("x.csv")).is_err());
    assert!(!root.path().join("b-v0").exists());
}
