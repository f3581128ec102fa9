//! Pages rendered from synthetic data: whole, small, deterministic, closed to the network and safe with any text.
//! They are left in cargo's directory for test files, so that they can be looked at.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use trueup::report::{
    Abscissa, BacktestPage, Cost, DiagnosisFigures, Exposure, Fill, InForce, Input, Metric, Trace, diagnosis_page,
};
use trueup::sim2real::Site;
use trueup::sim2real::diagnose::{
    Bin, ChannelFit, Checks, Diagnosis, Effect, Estimate, Excitation, Interval, Moved, NextExperiment, ParameterChange,
    Profile, Rival, SCHEMA, Score, Stretch, Verdict, Where,
};

/// A page must stay below this [bytes].
const MOST: usize = 1_500_000;

/// A small, fixed generator: these tests need noise, not quality.
struct Noise(u64);

impl Noise {
    /// About Gaussian, standard deviation 1.
    fn next(&mut self) -> f64 {
        let mut sum = 0.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum - 6.0
    }
}

fn servo_trace(recording: &str, held_out: bool, channel: &str, unit: &str, rows: usize) -> Trace {
    let mut noise = Noise(rows as u64);
    let scale = if unit == "rad" { 1.0 } else { 2.4 };
    let wave = |t: f64, lag: f64| scale * (0.8 * (1.3 * (t - lag)).sin() + 0.35 * (3.1 * (t - lag) + 0.4).sin());
    let time: Vec<f64> = (0..rows).map(|i| i as f64 * 24.0 / rows as f64).collect();
    let truth: Vec<f64> = time.iter().map(|t| wave(*t, 0.0)).collect();
    let measured = truth
        .iter()
        .enumerate()
        .map(|(i, v)| (!(rows / 3..rows / 3 + rows / 40).contains(&i)).then(|| v + 0.004 * scale * noise.next()))
        .collect();
    Trace {
        recording: recording.into(),
        held_out,
        channel: channel.into(),
        unit: unit.into(),
        abscissa: Abscissa::Time,
        nominal: time.iter().map(|t| 1.28 * wave(*t, 0.09)).collect(),
        recalibrated: time.iter().map(|t| 1.06 * wave(*t, 0.03) + 0.05 * (0.5 * t).sin()).collect(),
        trued: truth.iter().map(|v| v + 0.001).collect(),
        time,
        measured,
    }
}

fn score(mechanism: &str, stage: usize, screen: f64, gain: Option<f64>, accepted: bool) -> Score {
    Score {
        mechanism: mechanism.into(),
        form: String::new(),
        stage,
        screen,
        survival: 0.3 + 0.5 * screen,
        excited: true,
        gain,
        accepted,
    }
}

fn estimate(name: &str, value: f64, std: f64, unit: &str) -> (String, Estimate) {
    (name.into(), Estimate { value, std, unit: unit.into() })
}

fn fit(channel: &str, unit: &str, scale: f64) -> ChannelFit {
    ChannelFit {
        channel: channel.into(),
        unit: unit.into(),
        noise_floor: 0.0041 * scale,
        nominal_rmse: 0.2312 * scale,
        recalibrated_rmse: 0.0641 * scale,
        trued_rmse: 0.0043 * scale,
        nominal_mae: 0.1921 * scale,
        recalibrated_mae: 0.0523 * scale,
        trued_mae: 0.0034 * scale,
        improvement_ci95: [0.926, 0.941],
    }
}

fn change(name: &str, nominal: f64, value: f64, std: f64, unit: &str) -> (String, ParameterChange) {
    (name.into(), ParameterChange { nominal, value, std, unit: unit.into() })
}

fn stretch(recording: &str, start: f64, end: f64) -> Stretch {
    Stretch { recording: recording.into(), start, end }
}

/// What to record next, in words alone.
fn advice(what: &str) -> NextExperiment {
    let rivals = vec!["half_spread".into(), "command_delay".into()];
    NextExperiment { what: what.into(), file: None, rivals, separation: None, gain: None, gain_so_far: None }
}

/// The error of a channel over a state.
fn profile(channel: &str, on: &str, unit: &str) -> Profile {
    let at: Vec<f64> = (0..40).map(|k| -1.95 + 0.1 * f64::from(k)).collect();
    Profile {
        channel: channel.into(),
        unit: unit.into(),
        on: on.into(),
        on_unit: if on == "velocity" { "rad/s".into() } else { String::new() },
        recalibrated: at.iter().map(|v| 0.02 + 0.09 / (1.0 + 9.0 * v * v)).collect(),
        trued: at.iter().map(|v| 0.004 + 0.0002 * v).collect(),
        at,
        noise: 0.004,
    }
}

fn servo_diagnosis(recording: &str) -> Diagnosis {
    let interval = |start, end, share_of_error| Interval {
        channel: "position".into(),
        start,
        end,
        share_of_error,
        recording: recording.into(),
    };
    Diagnosis {
        schema: SCHEMA.into(),
        verdict: Verdict::Named,
        summary: "The twin leaves out Coulomb friction of 0.180 N m and a constant load of 0.052 N m; with both added its \
                  error on held-out data falls by 93 %, to the noise floor."
            .into(),
        effects: vec![
            Effect {
                mechanism: "coulomb_friction".into(),
                site: Site::Plant,
                confidence: 0.98,
                gain: Some(4_210.0),
                margin: Some(8.6),
                parameters: BTreeMap::from([estimate("torque", 0.180_34, 0.0021, "N m")]),
                rivals: vec![Rival { mechanism: "backlash".into(), confidence: 0.013 }],
                location: Some("|velocity| < 0.05 rad/s".into()),
                active: vec![stretch(recording, 3.0, 4.1), stretch(recording, 9.0, 9.8)],
                moved: vec![Moved { channel: "position".into(), rms: 0.0812, unit: "rad".into() }],
            },
            Effect {
                mechanism: "constant_load".into(),
                site: Site::Plant,
                confidence: 0.94,
                gain: Some(96.0),
                margin: Some(6.2),
                parameters: BTreeMap::from([estimate("torque", -0.0521, 0.0009, "N m")]),
                rivals: vec![Rival { mechanism: "bias".into(), confidence: 0.04 }],
                location: None,
                active: Vec::new(),
                moved: Vec::new(),
            },
        ],
        location: Where {
            intervals: vec![interval(2.0, 4.6, 0.31), interval(17.5, 19.0, 0.22)],
            onset: Some(12.4),
            against: vec![Bin {
                channel: "position".into(),
                on: "|velocity|".into(),
                unit: "rad/s".into(),
                from: None,
                to: Some(0.213),
                share_of_error: 0.71,
                share_of_rows: 0.17,
            }],
        },
        parameters: BTreeMap::from([
            change("inertia", 0.11, 0.104_21, 0.0004, "kg m^2"),
            change("viscous_friction", 0.25, 0.2313, 0.0061, "N m s/rad"),
            change("gravity_torque", 2.7, 2.691, 0.0123, "N m"),
            change("gain", 1.0, 1.0, 0.0, "N m per unit"),
        ]),
        fit: vec![fit("position", "rad", 1.0), fit("velocity", "rad/s", 2.4)],
        checks: Checks {
            adequacy: 1.13,
            remainder: 0.0042,
            placebo_p: Some(0.01),
            at_bound: Vec::new(),
            tried: 9,
            not_excited: vec!["quantization".into()],
            notes: vec!["Halving the integration step moves the output by 0.02 noise sigma.".into()],
        },
        next_experiment: None,
        scores: vec![
            score("coulomb_friction", 0, 0.91, Some(2412.4), true),
            score("stiffness", 0, 0.62, Some(611.0), false),
            score("dead_zone", 0, 0.58, Some(420.7), false),
            score("quadratic_drag", 0, 0.41, Some(38.2), false),
            score("actuator_lag", 0, 0.37, Some(-4.1), false),
            score("saturation", 0, 0.08, None, false),
            score("bias", 0, 0.05, None, false),
            score("command_delay", 0, 0.03, None, false),
            score("constant_load", 1, 0.72, Some(634.9), true),
            score("bias", 1, 0.69, Some(580.2), false),
            score("stiffness", 1, 0.11, Some(1.2), false),
            score("saturation", 1, 0.04, None, false),
        ],
        modelled: vec!["viscous_friction".into()],
        held_out: "the last 30 % in time of each recording".into(),
    }
}

fn servo_figures(recording: &str, rows: usize) -> DiagnosisFigures {
    DiagnosisFigures {
        traces: vec![
            servo_trace(recording, true, "position", "rad", rows),
            servo_trace(recording, true, "velocity", "rad/s", rows),
            servo_trace(recording, false, "position", "rad", rows),
        ],
        profiles: ["command", "position", "velocity"].map(|on| profile("position", on, "rad")).to_vec(),
        excitation: None,
    }
}

fn market_page() -> (Diagnosis, DiagnosisFigures) {
    let mut noise = Noise(3);
    let trace = |held_out, rows: usize, noise: &mut Noise| {
        let spread: Vec<f64> = (0..rows).map(|_| 1.4 + 0.5 * noise.next().abs()).collect();
        let walk: Vec<f64> = (0..rows).map(|_| 1.2 * noise.next().powi(2)).collect();
        let cost: Vec<f64> = spread.iter().zip(&walk).map(|(s, w)| s + w).collect();
        Trace {
            recording: "orders_2024".into(),
            held_out,
            channel: "cost".into(),
            unit: "bps".into(),
            abscissa: Abscissa::Order,
            time: (0..rows).map(|i| i as f64 * 11.0).collect(),
            measured: cost.iter().map(|c| Some(c + 0.12 * noise.next())).collect(),
            nominal: vec![0.0; rows],
            recalibrated: vec![2.9; rows],
            trued: cost,
        }
    };
    let traces = vec![trace(true, 700, &mut noise), trace(false, 2_500, &mut noise)];
    let figures = DiagnosisFigures { traces, ..DiagnosisFigures::default() };
    let mut diagnosis = servo_diagnosis("orders_2024");
    diagnosis.verdict = Verdict::Ambiguous;
    diagnosis.summary =
        "Orders pay half the spread and walk the book, which the backtest leaves out; whether an order also \
                         waits 250 ms these fills do not tell."
            .into();
    diagnosis.effects[0].mechanism = "half_spread".into();
    diagnosis.effects[0].parameters = BTreeMap::from([estimate("fraction", 0.993, 0.012, "")]);
    diagnosis.effects[0].location = Some("every marketable order".into());
    diagnosis.effects[1].mechanism = "book_walk".into();
    diagnosis.effects[1].parameters = BTreeMap::from([estimate("depth", 1.02, 0.03, "")]);
    diagnosis.fit = vec![fit("cost", "bps", 40.0)];
    diagnosis.parameters = BTreeMap::new();
    diagnosis.location.intervals.truncate(1);
    diagnosis.location.intervals[0].channel = "cost".into();
    (diagnosis.location.intervals[0].start, diagnosis.location.intervals[0].end) = (1500.0, 2600.0);
    diagnosis.next_experiment = Some(advice("Send 60 orders of one lot within 2 s of a price change"));
    (diagnosis, figures)
}

fn backtest() -> BacktestPage {
    let mut noise = Noise(7);
    let start = 1_704_205_800_000_000_000_i64;
    // A year of days of 390 minutes.
    let time: Vec<i64> = (0..252_i64)
        .flat_map(|d| (0..390_i64).map(move |m| start + (d * 86_400 * 7 / 5 + m * 60) * 1_000_000_000))
        .collect();
    let mut equity = vec![1_000_000.0];
    let mut position = vec![0.0];
    for i in 1..time.len() {
        let held = if (i / 9_000) % 3 == 1 {
            -400.0
        } else if (i / 4_000) % 2 == 0 {
            1_200.0
        } else {
            0.0
        };
        equity.push(equity[i - 1] + 0.7 + held * 0.12 * noise.next());
        position.push(held);
    }
    let metric = |name: &str, value: Option<&str>, help: &str| Metric {
        name: name.into(),
        value: value.map(Into::into),
        help: help.into(),
    };
    let cost = |kind: &str, amount, bps| Cost { kind: kind.into(), amount, bps: Some(bps) };
    let fill = |i: i64| Fill {
        time: start + i * 3_600_000_000_000,
        symbol: "SPY".into(),
        side: if i % 2 == 0 { "buy" } else { "sell" }.into(),
        quantity: 1_200.0,
        price: 471.25 + 0.0125 * i as f64,
        fee: 28.28,
    };
    BacktestPage {
        title:
            "sma_cross on SPY, 2 January to 20 December 2024: 6.9 % after costs, with a largest loss of 2.1 % on the way."
                .into(),
        currency: "USD".into(),
        metrics: vec![
            metric("Total return", Some("6.92 %"), "Final equity over first, less one."),
            metric("Sharpe ratio", Some("1.34"), "Mean over standard deviation of daily returns, times √252."),
            metric("Largest drawdown", Some("2.11 %"), "Deepest fall from a peak of equity."),
            metric("Volatility", Some("4.87 %"), "Standard deviation of daily returns, times √252."),
            metric("Turnover", Some("38.2 / year"), "Value traded over mean equity."),
            metric("Costs", Some("6,114.20 USD"), "Against the mid price at decision, fees included."),
            metric("Fills", Some("412"), "Of 412 orders sent."),
            metric("Sortino ratio", None, "Not defined: fewer than two losing days."),
        ],
        time,
        equity,
        exposures: vec![Exposure { name: "SPY".into(), unit: "shares".into(), values: position }],
        fills: (0..260).map(fill).collect(),
        fill_count: 412,
        costs: vec![
            cost("half_spread", 3_912.11, 0.521),
            cost("commission", 1_706.6, 0.227),
            cost("sqrt_impact", 495.49, 0.066),
        ],
        in_force: vec![
            InForce { name: "half_spread".into(), setting: "1.0 bps of the price".into() },
            InForce { name: "commission".into(), setting: "0.5 bps of the value traded".into() },
            InForce { name: "bar stamp".into(), setting: "the open of the bar; known at its close".into() },
        ],
        inputs: vec![Input {
            name: "bars.parquet".into(),
            rows: Some(98_280),
            sha256: "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".into(),
        }],
    }
}

/// What holds for every page.
fn check(name: &str, page: &str) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("report");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(name), page).unwrap();

    assert!(page.len() < MOST, "{name}: {} bytes", page.len());
    for fetches in ["<script", "<link", "<img", "<iframe", "<object", "src=", "@import", "http://", "https://", "url(h"] {
        assert!(!page.contains(fetches), "{name} contains `{fetches}`");
    }
    for wrong in ["NaN", "inf ", "undefined", "{{", "{%"] {
        let at = page.find(wrong);
        assert!(at.is_none(), "{name}: `{wrong}` in {:?}", at.map(|i| page.get(i.saturating_sub(80)..i + 20)));
    }
    balanced(name, page);
    let ids: Vec<&str> = page.split(" id=\"").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    let mut once = ids.clone();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), ids.len(), "{name}: an id is there twice");
    for target in page.split("url(#").skip(1).filter_map(|rest| rest.split(')').next()) {
        assert!(once.binary_search(&target).is_ok(), "{name}: no clip path {target}");
    }
    for svg in page.split("<svg").skip(1) {
        let head = svg.split('>').next().unwrap();
        assert!(head.contains("role=\"img\"") && head.contains("aria-label=\""), "{name}: a plot without a description");
    }
    assert_eq!(page.matches("<table").count(), page.matches("<thead").count(), "{name}: a table without headers");
}

/// Every element that is opened is closed, in order.
fn balanced(name: &str, page: &str) {
    let mut open: Vec<&str> = vec!["html", "head"];
    let body = page.split("</style>").nth(1).unwrap();
    for tag in body.split('<').skip(1) {
        let (head, _) = tag.split_once('>').unwrap_or_else(|| panic!("{name}: `<{}` never ends", &tag[..tag.len().min(60)]));
        let element = head.trim_start_matches('/').split([' ', '/']).next().unwrap();
        if head.starts_with('/') {
            assert_eq!(open.pop(), Some(element), "{name}: </{element}> closes something else");
        } else if !head.ends_with('/') && !["br", "meta"].contains(&element) {
            open.push(element);
        }
    }
    assert!(open.is_empty(), "{name}: {open:?} never closed");
}

#[test]
fn a_diagnosis_shows_all_its_evidence() {
    let figures = servo_figures("bench_03.csv", 12_000);
    let page = diagnosis_page(&servo_diagnosis("bench_03.csv"), &figures).unwrap();
    check("diagnosis.html", &page);
    let sections = ["answer", "where", "fitted", "ranking", "effects", "parameters", "errors", "held-out", "checks"];
    for pair in sections.windows(2) {
        let [first, second] = [0, 1].map(|k| page.find(&format!("<section id=\"{}\"", pair[k])).unwrap());
        assert!(first < second, "{pair:?} stand in another order");
    }
    for id in sections {
        assert!(page.contains(&format!("<section id=\"{id}\"")), "no section {id}");
        assert!(page.contains(&format!("href=\"#{id}\"")), "{id} is not in the contents");
    }
    assert!(!page.contains("id=\"held-out-orders\""), "a section with nothing to show");
    let summary = page.find("The twin leaves out Coulomb friction").unwrap();
    assert!(summary < page.find("<main>").unwrap(), "the summary comes first");
    assert!(page.contains("<span class=\"badge good\">named</span>"));
    for text in [
        "0.1803 ± 0.0021 N m",
        "−0.05210 ± 0.00090 N m",
        "0.1762 to 0.1845",
        "93 %",
        "92.6 to 94.1 %",
        "command_delay",
        "accepted",
        "−5 %",
        "It began at <b>12.40 s</b>",
        "<b>|velocity| &lt; 0.21 rad",
        "71 % of the squared error in 17 % of the rows",
        "moved the position by 0.0812 rad",
        "acted where <b>|velocity| &lt; 0.05 rad",
        "where what was found acted",
        "these recordings cannot tell",
    ] {
        assert!(page.replace('\u{a0}', " ").contains(text), "no `{text}`");
    }
    let (traces, profiles) = (3 * 2 * 2, 3);
    assert_eq!(page.matches("<svg").count(), traces + profiles, "each of three traces, level and residual, wide and narrow");
    assert_eq!(page, diagnosis_page(&servo_diagnosis("bench_03.csv"), &figures).unwrap(), "not the same bytes");
}

#[test]
fn the_next_experiment_shows_its_commands() {
    let mut diagnosis = servo_diagnosis("bench_03.csv");
    diagnosis.verdict = Verdict::Ambiguous;
    diagnosis.next_experiment = Some(NextExperiment {
        file: Some("next_experiment.csv".into()),
        separation: Some(0.223),
        gain: Some(126.4),
        gain_so_far: Some(0.087),
        ..advice("send next_experiment.csv and record as before")
    });
    let time: Vec<f64> = (0..5_000).map(|i| f64::from(i) * 4e-3).collect();
    let command = time.iter().map(|t| (t * t).sin()).collect();
    let mut figures = servo_figures("bench_03.csv", 500);
    figures.excitation = Some(Excitation { name: "a sine".into(), time, command });
    let page = diagnosis_page(&diagnosis, &figures).unwrap();
    check("next.html", &page);
    assert!(page.contains("<section id=\"next\"") && page.contains("Send next_experiment.csv and record as before."));
    assert!(page.contains("separation 0.223 noise σ") && page.contains("expected gain 126"));
    assert!(page.contains("of the recordings at hand 0.0870"));
}

#[test]
fn orders_are_scattered_and_residuals_numbered() {
    let (diagnosis, figures) = market_page();
    let page = diagnosis_page(&diagnosis, &figures).unwrap();
    check("orders.html", &page);
    assert!(page.contains("<section id=\"held-out-orders\"") && page.contains("<section id=\"fitted-orders\""));
    assert!(page.contains(">measured [bps]</text>") && page.contains(">order</text>"));
    assert!(page.contains("Send 60 orders"), "the next experiment");
}

#[test]
fn a_backtest_shows_its_money_and_its_assumptions() {
    let page = backtest().render().unwrap();
    check("backtest.html", &page);
    for id in ["metrics", "equity", "exposure", "costs", "assumptions", "fills", "inputs"] {
        assert!(page.contains(&format!("<section id=\"{id}\"")), "no section {id}");
    }
    assert!(page.contains("<dt>Sortino ratio</dt><dd class=\"figure\">–</dd>"), "an undefined metric is a dash");
    assert!(page.contains("The first 200, and 212 more"));
    assert!(page.contains("6,114.20") && page.contains("<th scope=\"row\">total</th>"));
    assert_eq!(page, backtest().render().unwrap(), "not the same bytes");
}

#[test]
fn text_from_input_stays_text() {
    let evil = "<script>alert('x')</script>\"><img src=x onerror=y>";
    let mut diagnosis = servo_diagnosis(evil);
    diagnosis.summary = evil.into();
    diagnosis.checks.notes.push(evil.into());
    diagnosis.checks.at_bound.push(evil.into());
    diagnosis.effects[0].mechanism = evil.into();
    diagnosis.scores[0].form = evil.into();
    let mut figures = servo_figures(evil, 500);
    figures.traces[0].unit = evil.into();
    figures.traces[0].channel = evil.into();
    let page = diagnosis_page(&diagnosis, &figures).unwrap();
    assert!(!page.contains("<script") && !page.contains("<img"));
    assert!(page.contains("&lt;script&gt;"));
    balanced("evil", &page);

    let mut backtest = backtest();
    backtest.title = evil.into();
    backtest.fills[0].symbol = evil.into();
    backtest.exposures[0].name = evil.into();
    backtest.exposures[0].unit = evil.into();
    let page = backtest.render().unwrap();
    assert!(!page.contains("<script") && !page.contains("<img"));
    balanced("evil backtest", &page);
}

#[test]
fn many_long_traces_stay_small_and_the_rest_are_named() {
    let traces: Vec<Trace> =
        (0..24).map(|k| servo_trace(&format!("run_{k:02}"), k % 2 == 0, "position", "rad", 40_000)).collect();
    let page =
        diagnosis_page(&servo_diagnosis("run_00"), &DiagnosisFigures { traces, ..DiagnosisFigures::default() }).unwrap();
    check("many.html", &page);
    assert!(page.contains("Not drawn: run_12: position"), "what is left out is named");
}

#[test]
fn what_is_not_a_number_is_a_dash() {
    let mut diagnosis = servo_diagnosis("r");
    diagnosis.verdict = Verdict::Unexplained;
    diagnosis.effects.clear();
    diagnosis.scores.clear();
    diagnosis.fit[0] = ChannelFit {
        noise_floor: 0.0,
        recalibrated_rmse: 0.0,
        trued_rmse: 0.0,
        improvement_ci95: [f64::NAN; 2],
        nominal_mae: f64::NAN,
        ..diagnosis.fit[0].clone()
    };
    diagnosis.checks.remainder = f64::NAN;
    diagnosis.checks.adequacy = f64::INFINITY;
    let mut figures = servo_figures("r", 300);
    figures.traces[0].nominal.fill(f64::NAN);
    figures.traces[0].recalibrated.iter_mut().enumerate().for_each(|(i, v)| *v = 10.0_f64.powi(i as i32));
    figures.traces[1].measured.fill(None);
    figures.traces[2].time.clear();
    let page = diagnosis_page(&diagnosis, &figures).unwrap();
    check("undefined.html", &page);
    assert!(page.contains("Something that none of the known mechanisms explains."));

    let empty = BacktestPage { title: "nothing".into(), equity: vec![f64::NAN], time: vec![0], ..BacktestPage::default() };
    check("empty.html", &empty.render().unwrap());
}
