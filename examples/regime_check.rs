//! Regimes of made series, for checks/regime_check.py to hold to other libraries: writes the series as CSV into a folder, and what
//! was found to stdout as JSON. With `--timed` it says nothing until it is asked: for each line on stdin, as `levels_100000 viterbi`, it
//! does that for some milliseconds, and tells the least seconds it took, so that whoever asks may time something else by turns.
//!
//! ```text
//! cargo run --release --example regime_check -- out/regimes >out/regimes/trueup.json
//! echo levels_100000 viterbi | cargo run --release --example regime_check -- --timed
//! ```

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};
use trueup::sim2real::Seed;
use trueup::sim2real::regime::{
    Cost, Division, Emission, Family, HiddenMarkov, Observations, Penalty, RegimeError, Settings, Spread, fit, refit,
};

/// For how long [s] a thing is done when it is asked for; the least of that time is told.
const SECONDS: f64 = 0.02;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Some(folder) = std::env::args().nth(1) else {
        return Err("usage: regime_check FOLDER, or regime_check --timed".into());
    };
    if folder == "--timed" { serve() } else { found(Path::new(&folder)) }
}

/// Writes the series, and what is found of them.
fn found(folder: &Path) -> Result<(), Box<dyn std::error::Error>> {
    std::fs::create_dir_all(folder)?;
    let mut cases = vec![];
    for (name, model, family, rows) in models()? {
        let values = model.simulate(rows, Seed(1)).values;
        write_series(&folder.join(format!("{name}.csv")), &values, model.width())?;
        cases.push(hidden_markov(name, &model, family, &values)?);
    }
    for (name, rows, seed) in DIVIDED {
        let series = steps(rows, seed)?;
        write_series(&folder.join(format!("{name}.csv")), &series, 1)?;
        for (told, cost) in COSTS {
            cases.push(division(name, &series, told, cost)?);
        }
    }
    println!("{}", serde_json::to_string_pretty(&json!({ "cases": cases }))?);
    Ok(())
}

/// What is divided: name, rows, seed.
const DIVIDED: [(&str, usize, u64); 2] = [("steps_2000", 2_000, 2), ("steps_5000", 5_000, 3)];

const COSTS: [(&str, Cost); 2] = [("l2", Cost::Mean), ("normal", Cost::MeanAndVariance)];

/// Does what lines on stdin ask for, and tells the least seconds of each.
fn serve() -> Result<(), Box<dyn std::error::Error>> {
    let timed = timed()?;
    for line in std::io::stdin().lines() {
        let line = line?;
        let run = timed.get(line.trim()).ok_or_else(|| format!("nothing is called `{line}`"))?;
        let (begun, mut least) = (Instant::now(), f64::INFINITY);
        while begun.elapsed().as_secs_f64() < SECONDS {
            let started = Instant::now();
            let times = run()?;
            least = least.min(started.elapsed().as_secs_f64() / times as f64);
        }
        println!("{least:e}");
        std::io::stdout().flush()?;
    }
    Ok(())
}

/// Does a thing and tells how many times.
type Timed = Box<dyn Fn() -> Result<usize, RegimeError>>;

fn timed() -> Result<BTreeMap<String, Timed>, RegimeError> {
    let mut timed = BTreeMap::<String, Timed>::new();
    for (name, model, family, rows) in models()? {
        let values = model.simulate(rows, Seed(1)).values;
        // They live as long as the process.
        let (model, values): (&HiddenMarkov, &[f64]) = (Box::leak(Box::new(model)), Vec::leak(values));
        let series = Observations::rows(values, model.width())?;
        let few = Settings { iterations: 20, tolerance: 0.0, ..settings(model, family) };
        let mut put = |what: &str, run: Timed| timed.insert(format!("{name} {what}"), run);
        put("log_likelihood", Box::new(move || model.log_likelihood(series).map(|_| 1)));
        put("viterbi", Box::new(move || model.viterbi(series).map(|_| 1)));
        put("posterior", Box::new(move || model.smooth(series).map(|_| 1)));
        put("iteration", Box::new(move || refit(model, &[series], &few).map(|fit| fit.iterations)));
    }
    for (name, rows, seed) in DIVIDED {
        let series: &[f64] = Vec::leak(steps(rows, seed)?);
        for (told, cost) in COSTS {
            let division = division_of(cost, series);
            timed.insert(format!("{name} {told}"), Box::new(move || division.divide(series).map(|_| 1)));
        }
    }
    Ok(timed)
}

fn settings(model: &HiddenMarkov, family: Family) -> Settings {
    Settings { family, tolerance: 1e-9, iterations: 1_000, ..Settings::new(model.states()) }
}

fn division_of(cost: Cost, series: &[f64]) -> Division {
    if cost == Cost::Mean {
        Division { cost, penalty: Penalty::Bic, shortest: 2 }
    } else {
        Division { cost, penalty: Penalty::Given(4.0 * (series.len() as f64).ln()), shortest: 5 }
    }
}

type Case = (&'static str, HiddenMarkov, Family, usize);

fn models() -> Result<Vec<Case>, RegimeError> {
    let diagonal = |mean: &[f64], deviations: &[f64]| Emission {
        mean: mean.to_vec(),
        spread: Spread::Diagonal(deviations.iter().map(|d| d * d).collect()),
        degrees: None,
    };
    let full = |mean: [f64; 2], a: f64, b: f64, c: f64| Emission {
        mean: mean.to_vec(),
        spread: Spread::Full(vec![vec![a, c], vec![c, b]]),
        degrees: None,
    };
    let three = || vec![vec![0.98, 0.015, 0.005], vec![0.03, 0.95, 0.02], vec![0.02, 0.08, 0.9]];
    let two = || vec![vec![0.97, 0.03], vec![0.05, 0.95]];
    let scalar = |a: (f64, f64), b: (f64, f64), c: (f64, f64)| {
        [a, b, c].map(|(mean, deviation)| diagonal(&[mean], &[deviation])).to_vec()
    };
    Ok(vec![
        (
            "volatility_5000",
            HiddenMarkov::new(vec![0.6, 0.3, 0.1], three(), scalar((0.05, 0.5), (0.0, 1.2), (-0.2, 3.0)))?,
            Family::Gaussian,
            5_000,
        ),
        (
            "levels_100000",
            HiddenMarkov::new(vec![0.6, 0.3, 0.1], three(), scalar((0.0, 0.8), (2.0, 1.0), (5.0, 1.2)))?,
            Family::Gaussian,
            100_000,
        ),
        (
            "two_columns_20000",
            HiddenMarkov::new(
                vec![0.5, 0.5],
                two(),
                vec![diagonal(&[0.0, 1.0], &[1.0, 0.5]), diagonal(&[1.0, -1.0], &[2.0, 1.0])],
            )?,
            Family::Gaussian,
            20_000,
        ),
        (
            "covariance_20000",
            HiddenMarkov::new(
                vec![0.5, 0.5],
                two(),
                vec![full([0.0, 0.0], 1.0, 1.0, 0.8), full([0.5, -0.5], 2.0, 1.5, -1.0)],
            )?,
            Family::GaussianFull,
            20_000,
        ),
    ])
}

/// The true parameters on the series: log-likelihood, path and posterior; and a fit of its own starts.
fn hidden_markov(name: &str, model: &HiddenMarkov, family: Family, values: &[f64]) -> Result<Value, RegimeError> {
    let series = Observations::rows(values, model.width())?;
    let (path, path_log) = model.viterbi(series)?;
    let fitted = fit(&[series], &settings(model, family))?;
    Ok(json!({
        "kind": "hidden_markov", "series": name, "rows": series.len(), "width": model.width(),
        "full": family == Family::GaussianFull, "model": model,
        "log_likelihood": model.log_likelihood(series)?, "path": path, "path_log": path_log,
        "posterior": model.smooth(series)?.chunks(model.states()).map(|p| p[0]).collect::<Vec<_>>(),
        "fit": {
            "model": fitted.model, "log_likelihood": fitted.log_likelihood, "converged": fitted.converged,
            "iterations": fitted.iterations, "path": fitted.model.viterbi(series)?.0,
        },
    }))
}

fn division(name: &str, series: &[f64], told: &str, cost: Cost) -> Result<Value, RegimeError> {
    let division = division_of(cost, series);
    let found = division.divide(series)?;
    Ok(json!({
        "kind": "change_points", "series": name, "rows": series.len(), "cost": told, "penalty": found.penalty,
        "shortest": division.shortest, "changes": found.changes, "total": found.cost,
    }))
}

/// Stretches of 20 to 400 rows, each of a level and a spread.
fn steps(rows: usize, seed: u64) -> Result<Vec<f64>, RegimeError> {
    let states: Vec<Emission> = (0..6)
        .map(|k| Emission {
            mean: vec![f64::from(k * 7 % 6) * 1.5],
            spread: Spread::Diagonal(vec![(0.5 + 0.3 * f64::from(k % 3)).powi(2)]),
            degrees: None,
        })
        .collect();
    let stay = 0.99;
    let row = |from: usize| (0..6).map(|to| if to == from { stay } else { (1.0 - stay) / 5.0 }).collect();
    let model = HiddenMarkov::new(vec![1.0 / 6.0; 6], (0..6).map(row).collect(), states)?;
    Ok(model.simulate(rows, Seed(seed)).values)
}

fn write_series(path: &Path, values: &[f64], width: usize) -> std::io::Result<()> {
    let mut text = (0..width).map(|column| format!("x{column}")).collect::<Vec<_>>().join(",");
    text.push('\n');
    for row in values.chunks(width) {
        let cells: Vec<String> = row.iter().map(f64::to_string).collect();
        // Writing to a string does not fail.
        let _ = writeln!(text, "{}", cells.join(","));
    }
    std::fs::write(path, text)
}
