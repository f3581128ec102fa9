//! Regimes of made series, for checks/regime_check.py to hold to other libraries: writes the series as CSV into a folder, and what
//! was found, with the time it took, to stdout as JSON.
//!
//! ```text
//! cargo run --release --example regime_check -- out/regimes >out/regimes/trueup.json
//! ```

use std::fmt::Write as _;
use std::path::Path;
use std::time::Instant;

use serde_json::{Value, json};
use trueup::sim2real::Seed;
use trueup::sim2real::regime::{
    Cost, Division, Emission, Family, HiddenMarkov, Observations, Penalty, RegimeError, Settings, Spread, fit, refit,
};

/// Times each thing is timed at least, and for how long [s]: the least and the most are told. A machine with other things to do is slower for
/// some seconds, and so is whatever is timed in them.
const ROUNDS: usize = 15;
const SECONDS: f64 = 2.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let Some(folder) = std::env::args().nth(1) else {
        return Err("usage: regime_check FOLDER".into());
    };
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let mut cases = vec![];
    for (name, model, family, rows) in models()? {
        let drawn = model.simulate(rows, Seed(1));
        write_series(&folder.join(format!("{name}.csv")), &drawn.values, model.width())?;
        cases.push(hidden_markov(name, &model, family, &drawn.values)?);
    }
    for (name, rows, seed) in [("steps_2000", 2_000, 2), ("steps_5000", 5_000, 3)] {
        let series = steps(rows, seed)?;
        write_series(&folder.join(format!("{name}.csv")), &series, 1)?;
        for (cost, told, shortest) in [(Cost::Mean, "l2", 2), (Cost::MeanAndVariance, "normal", 5)] {
            cases.push(division(name, &series, cost, told, shortest)?);
        }
    }
    println!("{}", serde_json::to_string_pretty(&json!({ "rounds": ROUNDS, "seconds": SECONDS, "cases": cases }))?);
    Ok(())
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

/// The true parameters on the series: log-likelihood and path; iterations from them; and a fit of its own starts.
fn hidden_markov(name: &str, model: &HiddenMarkov, family: Family, values: &[f64]) -> Result<Value, RegimeError> {
    let series = Observations::rows(values, model.width())?;
    let (path, path_log) = model.viterbi(series)?;
    let settings = Settings { family, tolerance: 1e-9, iterations: 1_000, ..Settings::new(model.states()) };
    let fitted = fit(&[series], &settings)?;
    let few = Settings { iterations: 20, tolerance: 0.0, ..settings };
    let iteration = least_and_most(|| {
        let started = Instant::now();
        let iterations = refit(model, &[series], &few)?.iterations;
        Ok(started.elapsed().as_secs_f64() / iterations as f64)
    })?;
    let timed = |run: &dyn Fn() -> Result<(), RegimeError>| {
        least_and_most(|| {
            let started = Instant::now();
            run()?;
            Ok(started.elapsed().as_secs_f64())
        })
    };
    let decode = timed(&|| model.viterbi(series).map(drop))?;
    let smooth = timed(&|| model.smooth(series).map(drop))?;
    let score = timed(&|| model.log_likelihood(series).map(drop))?;
    Ok(json!({
        "kind": "hidden_markov", "series": name, "rows": series.len(), "width": model.width(),
        "full": family == Family::GaussianFull, "model": model,
        "log_likelihood": model.log_likelihood(series)?, "path": path, "path_log": path_log,
        "posterior": model.smooth(series)?.chunks(model.states()).map(|p| p[0]).collect::<Vec<_>>(),
        "fit": {
            "model": fitted.model, "log_likelihood": fitted.log_likelihood, "converged": fitted.converged,
            "iterations": fitted.iterations, "path": fitted.model.viterbi(series)?.0,
        },
        "seconds": { "iteration": iteration, "viterbi": decode, "posterior": smooth, "log_likelihood": score },
    }))
}

fn division(name: &str, series: &[f64], cost: Cost, told: &str, shortest: usize) -> Result<Value, RegimeError> {
    let penalty = if cost == Cost::Mean { Penalty::Bic } else { Penalty::Given(4.0 * (series.len() as f64).ln()) };
    let division = Division { cost, penalty, shortest };
    let found = division.divide(series)?;
    let seconds = least_and_most(|| {
        let started = Instant::now();
        division.divide(series)?;
        Ok(started.elapsed().as_secs_f64())
    })?;
    Ok(json!({
        "kind": "change_points", "series": name, "rows": series.len(), "cost": told, "penalty": found.penalty,
        "shortest": shortest, "changes": found.changes, "total": found.cost, "seconds": { "divide": seconds },
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

fn least_and_most(mut run: impl FnMut() -> Result<f64, RegimeError>) -> Result<[f64; 2], RegimeError> {
    let (mut bounds, mut rounds, started) = ([f64::INFINITY, 0.0], 0, Instant::now());
    while rounds < ROUNDS || started.elapsed().as_secs_f64() < SECONDS {
        let seconds = run()?;
        bounds = [bounds[0].min(seconds), bounds[1].max(seconds)];
        rounds += 1;
    }
    Ok(bounds)
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
