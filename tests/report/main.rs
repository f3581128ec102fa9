//! Pages rendered from synthetic data: whole, small, deterministic, closed to the network and safe with any text.
//! They are left in cargo's directory for test files, so that they can be looked at.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails where a value is missing")]

mod pages;

use pages::{advice, backtest, balanced, check, market_page, servo_diagnosis, servo_figures, servo_trace};
use trueup::report::{BacktestPage, DiagnosisFigures, Trace, diagnosis_page};
use trueup::sim2real::diagnose::{ChannelFit, Excitation, NextExperiment, Verdict};

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
    for id in [
        "metrics",
        "equity",
        "months",
        "drawdowns",
        "figures",
        "trades",
        "exposure",
        "costs",
        "assumptions",
        "fills",
        "inputs",
    ] {
        assert!(page.contains(&format!("<section id=\"{id}\"")), "no section {id}");
    }
    assert!(page.contains("<dt>Sortino ratio</dt><dd class=\"figure\">–</dd>"), "an undefined metric is a dash");
    assert!(page.contains("<dt>Kurtosis</dt><dd class=\"figures\">–</dd>") && page.contains("<h3>Risk</h3>"));
    assert!(page.contains("The first 200, and 212 more"));
    assert!(page.contains("not by the end") && page.contains("by months of America&#x2f;New_York"));
    // Of fifty trips, half gain; those of the largest sums, the first and the last are listed.
    for table in ["The 10 that gained most", "The 10 that lost most", "The first 20", "The last 20"] {
        assert_eq!(page.matches(&format!("<summary>{table}</summary>")).count(), 1, "{table}");
    }
    let most = page.split("The 10 that gained most</summary>").nth(1).unwrap();
    let row = most.split("<tbody><tr>").nth(1).unwrap().split("</tr>").next().unwrap();
    assert!(row.contains("504.00"), "the largest gain comes first: {row}");
    assert!(page.contains("still held") && page.contains("all 50 are in <code>trades.parquet</code>"));
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
    backtest.zone = evil.into();
    backtest.trades[0].symbol = evil.into();
    backtest.figures[0].title = evil.into();
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
