//! The diagnoses of a servo and of orders, and the series behind them.

use std::collections::BTreeMap;

use trueup::report::{Abscissa, DiagnosisFigures, Trace};
use trueup::sim2real::Site;
use trueup::sim2real::diagnose::{
    Bin, ChannelFit, Checks, Diagnosis, Effect, Estimate, Interval, Moved, NextExperiment, ParameterChange, Profile, Rival,
    SCHEMA, Score, Stretch, Verdict, Where,
};

use super::Noise;

pub fn servo_trace(recording: &str, held_out: bool, channel: &str, unit: &str, rows: usize) -> Trace {
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
pub fn advice(what: &str) -> NextExperiment {
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

pub fn servo_diagnosis(recording: &str) -> Diagnosis {
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
            ..Where::default()
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

pub fn servo_figures(recording: &str, rows: usize) -> DiagnosisFigures {
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

pub fn market_page() -> (Diagnosis, DiagnosisFigures) {
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
