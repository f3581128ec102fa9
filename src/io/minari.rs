//! Data sets as Minari has them (<https://minari.farama.org>, version 0.5), in its Arrow form.
//!
//! A data set is a folder `data` with a `metadata.json`, and a folder for each episode, `0`, `1`, …, with a `metadata.json` of its
//! own and one record batch in `part-0.arrow`: columns `observations`, `actions`, `rewards`, `terminations` and `truncations`. It
//! has as many rows as observations, so that the last row of all columns but that holds nothing of meaning.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use polars::prelude::{
    Column, DataFrame, DataType, Float32Type, Int64Type, IntoColumn, IntoSeries, IpcWriter, ListBuilderTrait,
    ListPrimitiveChunkedBuilder, NamedFrom, PolarsResult, SerWriter, Series,
};
use serde_json::{Map, Value, json};

use super::episode_file::{ActionColumns, EpisodeColumns, EpisodeFile, SpaceColumns};
use super::error::InputError;
use super::output_folder::Overwrite;

/// The version of Minari whose form is written.
const VERSION: &str = "0.5.4";

/// The most rows of an episode that Minari reads as one: a batch of pyarrow's scanner. Of a longer one it would take the rest for
/// the next episode.
const MOST_ROWS: usize = 131_072;

/// Writes episodes as the data set `id` (as `trueup/cartpole/expert-v0`) into the folder `root/id`, whole or not at all. Minari finds
/// it by its id where `root` is its folder of data sets (`MINARI_DATASETS_PATH`).
///
/// An episode's `metadata.json` holds the `seed` its environment was reset with, where it was the first of that seed; of any, it
/// holds `lane_seed` and `lane_episode`.
///
/// # Errors
/// An id Minari does not take; episodes that do not fit together, or are none; one of more than 131,071 steps; a data set that exists, unless writing over is
/// forced; a place where nothing can be written.
pub fn write_minari(root: &Path, id: &str, file: &EpisodeFile<'_>, overwrite: Overwrite) -> Result<(), InputError> {
    let folder = root.join(id);
    check_id(&folder, id)?;
    file.check(&folder)?;
    if file.episodes.is_empty() {
        return Err(
            InputError::new(&folder, "there is no episode to be written").hint("record one to its end, or cut it off")
        );
    }
    if let Some(k) = file.episodes.iter().position(|one| one.rewards.len() >= MOST_ROWS) {
        let message = format!("Minari reads no more than {} steps of an episode", MOST_ROWS - 1);
        return Err(InputError::new(&folder, message)
            .found(format!("{} steps of episode {k}", file.episodes[k].rewards.len()))
            .hint("put a limit of time around the environment, or write a table"));
    }
    if folder.exists() && overwrite == Overwrite::Refuse {
        return Err(InputError::new(&folder, "the data set exists already, and nothing is written over unasked")
            .hint("give it another id or version, or allow it"));
    }
    let failed = |error: std::io::Error| {
        InputError::new(&folder, format!("cannot be written ({error})")).hint("is there room, and the right to write there?")
    };
    let parent = folder.parent().unwrap_or(root);
    fs::create_dir_all(parent).map_err(failed)?;
    // Aside, but on the same file system, so that a rename is all that is left to do.
    let aside = tempfile::Builder::new().prefix(".unfinished-").tempdir_in(parent).map_err(failed)?;
    let data = aside.path().join("new").join("data");
    fs::create_dir_all(&data).map_err(failed)?;
    let mut size = 0;
    for (k, episode) in file.episodes.iter().enumerate() {
        let own = data.join(k.to_string());
        fs::create_dir(&own).map_err(failed)?;
        let bytes = batch(episode, file).map_err(|error| InputError::new(&folder, format!("episode {k}: {error}")))?;
        size += bytes.len();
        fs::write(own.join("part-0.arrow"), bytes).map_err(failed)?;
        fs::write(own.join("metadata.json"), episode_metadata(k, episode).to_string()).map_err(failed)?;
    }
    fs::write(data.join("metadata.json"), metadata(id, file, size).to_string()).map_err(failed)?;
    if folder.exists() {
        fs::rename(&folder, aside.path().join("old")).map_err(failed)?;
    }
    fs::rename(aside.path().join("new"), &folder).map_err(failed)
}

/// An id is `(namespace/)name-vVERSION`, of letters, digits, `_` and `-`.
fn check_id(folder: &Path, id: &str) -> Result<(), InputError> {
    let plain = |part: &str| !part.is_empty() && part.chars().all(|c| c.is_alphanumeric() || c == '_' || c == '-');
    let numbered = id.rsplit_once("-v").is_some_and(|(name, version)| {
        !name.is_empty() && !name.ends_with('/') && !version.is_empty() && version.chars().all(|c| c.is_ascii_digit())
    });
    if numbered && id.split('/').all(plain) {
        return Ok(());
    }
    Err(InputError::new(folder, "Minari takes no data set of this id")
        .found_text(id)
        .hint("name it as in `trueup/cartpole/expert-v0`: letters, digits, `_`, `-`, and a version at the end"))
}

fn metadata(id: &str, file: &EpisodeFile<'_>, size: usize) -> Value {
    json!({
        "total_episodes": file.episodes.len(),
        "total_steps": file.steps(),
        "data_format": "arrow",
        "jpeg_encoding": false,
        "observation_space": space(&file.observation),
        "action_space": space(&file.action),
        "dataset_id": id,
        "minari_version": VERSION,
        // In megabytes, to one digit.
        "dataset_size": (size as f64 / 1e5).round() / 10.0,
        "description": format!("Episodes of {}, recorded by trueup.", file.environment),
        "requirements": ["trueup"],
    })
}

fn episode_metadata(k: usize, episode: &EpisodeColumns<'_>) -> Value {
    let mut all = Map::new();
    all.insert("id".into(), k.into());
    all.insert("total_steps".into(), episode.rewards.len().into());
    if episode.number == 0 {
        all.insert("seed".into(), episode.seed.into());
    }
    all.insert("lane_seed".into(), episode.seed.into());
    all.insert("lane_episode".into(), episode.number.into());
    Value::Object(all)
}

/// A space as a text of JSON, as Minari keeps it. Infinity is written as Python's `json` does.
fn space(space: &SpaceColumns) -> String {
    match space {
        SpaceColumns::Box { low, high, shape, .. } => {
            let mut text = format!("{{\"type\": \"Box\", \"dtype\": \"float32\", \"shape\": {shape:?}");
            for (name, values) in [("low", low), ("high", high)] {
                // Writing to a String cannot fail.
                let _ = write!(text, ", \"{name}\": {}", nested(values, shape));
            }
            text + "}"
        }
        SpaceColumns::Discrete { n, .. } => {
            format!("{{\"type\": \"Discrete\", \"dtype\": \"int64\", \"start\": 0, \"n\": {n}}}")
        }
        SpaceColumns::MultiDiscrete { n, .. } => {
            let start = vec![0; n.len()];
            format!("{{\"type\": \"MultiDiscrete\", \"dtype\": \"int64\", \"nvec\": {n:?}, \"start\": {start:?}}}")
        }
    }
}

/// Numbers in lists of lists of this shape.
fn nested(values: &[f32], shape: &[usize]) -> String {
    let Some((_, inner)) = shape.split_first() else {
        return values.first().map_or_else(String::new, |value| number(*value));
    };
    let parts = values.chunks(inner.iter().product::<usize>().max(1)).map(|part| nested(part, inner));
    format!("[{}]", parts.collect::<Vec<_>>().join(", "))
}

fn number(value: f32) -> String {
    match value {
        f32::INFINITY => "Infinity".into(),
        f32::NEG_INFINITY => "-Infinity".into(),
        // The digits of the number itself, not the fewest that tell it from its neighbours in single precision.
        value => format!("{:?}", f64::from(value)),
    }
}

fn batch(episode: &EpisodeColumns<'_>, file: &EpisodeFile<'_>) -> PolarsResult<Vec<u8>> {
    let rows = episode.rewards.len() + 1;
    let observations = reals("observations", episode.observations, rows);
    let actions = match (episode.actions, &file.action) {
        (ActionColumns::Continuous(values), _) => reals("actions", &padded(values, rows), rows),
        (ActionColumns::Discrete(values), SpaceColumns::Discrete { .. }) => {
            Series::new("actions".into(), padded(values, rows)).into_column()
        }
        (ActionColumns::Discrete(values), _) => {
            let values = padded(values, rows);
            let (name, size) = ("actions".into(), values.len() / rows);
            let mut lists = ListPrimitiveChunkedBuilder::<Int64Type>::new(name, rows, values.len(), DataType::Int64);
            values.chunks(size.max(1)).for_each(|row| lists.append_slice(row));
            lists.finish().into_series().into_column()
        }
    };
    let columns = vec![
        observations,
        actions,
        Series::new("rewards".into(), padded(episode.rewards, rows)).into_column(),
        Series::new("terminations".into(), padded(episode.terminated, rows)).into_column(),
        Series::new("truncations".into(), padded(episode.truncated, rows)).into_column(),
    ];
    let mut frame = DataFrame::new_infer_height(columns)?;
    let mut bytes = Vec::new();
    IpcWriter::new(&mut bytes).finish(&mut frame)?;
    Ok(bytes)
}

/// A column of rows of equally many real numbers.
fn reals(name: &str, values: &[f32], rows: usize) -> Column {
    let size = (values.len() / rows).max(1);
    let mut lists = ListPrimitiveChunkedBuilder::<Float32Type>::new(name.into(), rows, values.len(), DataType::Float32);
    values.chunks(size).for_each(|row| lists.append_slice(row));
    lists.finish().into_series().into_column()
}

/// `values` of `rows` - 1 rows, and one more of zeros.
fn padded<T: Copy + Default>(values: &[T], rows: usize) -> Vec<T> {
    let size = values.len() / (rows - 1).max(1);
    values.iter().copied().chain(std::iter::repeat_n(T::default(), size)).collect()
}
