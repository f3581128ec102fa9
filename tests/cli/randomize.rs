//! From diagnosis to randomization and back, as users meet them: what a diagnosis is sure of is written, drawn, and covers the
//! recording it came from; and what does not is detected and said.

#![allow(clippy::unwrap_used, reason = "a test fails where a value is missing")]

use std::fs;
use std::path::Path;

use crate::command_scene::Folder;
use serde_json::Value;
use trueup::io::Table;

fn data() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("data")
}

/// A folder with the servo's twin and the first 1,500 rows (6 s) of its recordings.
fn servo() -> Folder {
    let source = data().join("servo");
    let rows = |name: &str| {
        let text = fs::read_to_string(source.join(name)).unwrap();
        text.lines().take(1_501).collect::<Vec<_>>().join("\n") + "\n"
    };
    let twin = fs::read_to_string(source.join("twin.toml")).unwrap();
    Folder::with(&[("twin.toml", &twin), ("train.csv", &rows("train.csv")), ("test.csv", &rows("test.csv"))])
}

/// A folder with the bars of the examples and a run that ends with `more`.
fn bars(more: &str) -> Folder {
    let source = data().join("bars");
    let run = fs::read_to_string(source.join("run.toml")).unwrap();
    let folder = Folder::with(&[("run.toml", &format!("{run}\n{more}"))]);
    fs::copy(source.join("bars.parquet"), folder.path("bars.parquet")).unwrap();
    folder
}

fn share(coverage: &Value, band: f64) -> f64 {
    let shares = coverage["within"].as_array().unwrap();
    shares.iter().find(|one| one["band"].as_f64() == Some(band)).unwrap()["share"].as_f64().unwrap()
}

#[test]
fn a_posterior_covers_the_recording_it_came_from_and_one_it_has_not_seen() {
    let scene = servo();
    let diagnosed = scene.run("diagnose twin.toml --recording train.csv --holdout test.csv --out found");
    assert_eq!(diagnosed.0, 0, "{}", diagnosed.2);
    let trued = String::from_utf8(scene.bytes("found/trued.toml")).unwrap();
    assert!(trued.contains("[posterior]") && trued.contains("\"coulomb_friction."), "{trued}");
    for recording in ["train.csv", "test.csv"] {
        let rolled = scene.json(&format!("rollout found/trued.toml --recording {recording} --draws 200"));
        assert_eq!(rolled["covered"], true, "{rolled}");
        let position = &rolled["coverage"][0];
        let (half, most, nearly_all) = (share(position, 0.5), share(position, 0.95), share(position, 0.99));
        assert!((0.90..=0.99).contains(&most), "the 95 % band holds {most} of {recording}");
        assert!((0.4..=0.8).contains(&half) && nearly_all >= most, "the 50 % band holds {half} of {recording}");
        // The posterior is narrow: its bands are those of the noise, and not of ignorance.
        let (width, noise) = (position["width"].as_f64().unwrap(), position["noise_floor"].as_f64().unwrap());
        assert!(width < 2.0 * 2.0 * 1.96 * noise, "the 95 % band is {width} wide, noise {noise}");
    }
}

#[test]
fn draws_that_exclude_the_truth_are_detected_and_said() {
    let scene = servo();
    let twin = String::from_utf8(scene.bytes("twin.toml")).unwrap();
    // The recordings have dry friction of 0.18 N m: these draws have a third of it at most.
    let prior = "\n[[randomize.parameter]]\nmechanism = \"coulomb_friction\"\nparameter = \"torque\"\n\
                 distribution = \"uniform\"\nlow = 0.0\nhigh = 0.06\n";
    fs::write(scene.path("prior.toml"), twin + prior).unwrap();
    let (code, out, err) = scene.run("rollout prior.toml --recording test.csv --fail-on not_covered --out rolled");
    assert_eq!(code, 1, "{err}");
    assert!(out.starts_with("The draws do not cover the recording: "), "{out}");
    let said = out.replace('\n', " ");
    assert!(
        said.contains("lie outside the 99\u{a0}% band, first at t = ") && said.contains("hint: what was recorded"),
        "{out}"
    );
    for file in ["rollout.json", "draws.parquet", "bands.parquet", "report.html"] {
        assert!(scene.path("rolled").join(file).is_file(), "{file}");
    }
    let draws = Table::read(scene.path("rolled/draws.parquet")).unwrap();
    let torque = draws.floats("coulomb_friction.torque").unwrap();
    assert!(torque.len() == 200 && torque.iter().flatten().all(|v| (0.0..=0.06).contains(v)));
    let page = String::from_utf8(scene.bytes("rolled/report.html")).unwrap();
    assert!(page.contains("not covered") && page.contains("var(--band)") && !page.contains("NaN"));
    // Nothing is written over without being asked.
    assert!(scene.refused("rollout prior.toml --recording test.csv --out rolled").contains("--force"));
}

#[test]
fn a_rollout_is_the_same_at_any_number_of_threads() {
    let scene = servo();
    let twin = String::from_utf8(scene.bytes("twin.toml")).unwrap();
    fs::write(scene.path("twin.toml"), twin + "\n[randomize]\npreset = [\"physics\", \"actuators\"]\nlevel = 0.3\n")
        .unwrap();
    for (threads, out) in [(1, "a"), (3, "b")] {
        let ran = scene.run(&format!("rollout twin.toml --recording test.csv --draws 40 --out {out} --threads {threads}"));
        assert_eq!(ran.0, 0, "{}", ran.2);
    }
    for file in ["rollout.json", "draws.parquet", "bands.parquet", "report.html"] {
        assert_eq!(scene.bytes(&format!("a/{file}")), scene.bytes(&format!("b/{file}")), "{file}");
    }
}

/// Rows `t,u,...` of a motion by Heun's method in steps of 1 ms, written every 20 ms with what a sensor adds.
fn motion<const N: usize>(
    seconds: f64,
    mut state: [f64; N],
    command: impl Fn(f64) -> f64,
    slope: impl Fn(&[f64; N], f64) -> [f64; N],
    seen: &[(&str, usize)],
) -> String {
    let names: Vec<&str> = seen.iter().map(|(name, _)| *name).collect();
    let mut text = format!("t,u,{}\n", names.join(","));
    for row in 0..(seconds / 0.02) as usize {
        let t = row as f64 * 0.02;
        let u = command(t);
        let noise = |k: usize| 1e-3 * (((row * 31 + k * 17) % 23) as f64 / 11.0 - 1.0);
        let values = seen.iter().map(|(_, k)| format!("{:.6}", state[*k] + noise(*k)));
        text += &format!("{t:.3},{u},{}\n", values.collect::<Vec<_>>().join(","));
        for _ in 0..20 {
            let first = slope(&state, u);
            let there = std::array::from_fn(|k| state[k] + 1e-3 * first[k]);
            let second = slope(&there, u);
            state = std::array::from_fn(|k| state[k] + 5e-4 * (first[k] + second[k]));
        }
    }
    text
}

/// Friction of the cart of 0.8 N s/m, under a pole that hangs and swings.
fn swinging() -> String {
    let (mass, pole, half, gravity, friction, hinge) = (1.0, 0.2, 0.4, 9.81, 0.8, 0.01);
    let slope = |s: &[f64; 4], u: f64| {
        let [_, v, q, w] = *s;
        let (sin, cos) = q.sin_cos();
        // Both equations of motion at once: [[mass + pole, m l cos], [m l cos, 4/3 m l^2]] (a, q'') = right-hand sides.
        let (a11, a12, a22) = (mass + pole, pole * half * cos, 4.0 / 3.0 * pole * half * half);
        let (b1, b2) = (5.0 * u - friction * v + pole * half * w * w * sin, pole * gravity * half * sin - hinge * w);
        let det = a11 * a22 - a12 * a12;
        [v, (b1 * a22 - b2 * a12) / det, w, (a11 * b2 - a12 * b1) / det]
    };
    let push = |t: f64| if (0.7 * t) as i64 % 2 == 0 { 0.6 } else { -0.6 };
    motion(6.0, [0.0, 0.0, std::f64::consts::PI, 0.0], push, slope, &[("x", 0), ("a", 2)])
}

const SWINGING: &str = "
[twin]
model = \"cart_pole\"
[parameters]
cart_mass     = { value = 1.0, unit = \"kg\" }
pole_mass     = { value = 0.2, unit = \"kg\" }
half_length   = { value = 0.4, unit = \"m\" }
gravity       = { value = 9.81, unit = \"m/s^2\" }
cart_friction = { value = 0.5, unit = \"N s/m\" }
pole_friction = { value = 0.01, unit = \"N m s\" }
gain          = { value = 5.0, unit = \"N per unit\" }
[channels]
command  = { column = \"u\" }
position = { column = \"x\", unit = \"m\" }
angle    = { column = \"a\", unit = \"rad\" }
";

/// Two tanks, of which the upper's outflow is 0.3 m^0.5/s.
fn filling() -> String {
    let slope = |s: &[f64; 2], u: f64| {
        let (upper, lower) = (s[0].max(0.0).sqrt(), s[1].max(0.0).sqrt());
        [0.4 * u - 0.3 * upper, 0.25 * upper - 0.2 * lower]
    };
    let pump = |t: f64| if (t / 8.0) as i64 % 2 == 0 { 1.2 } else { 0.5 };
    motion(40.0, [1.0, 1.0], pump, slope, &[("level", 1)])
}

const FILLING: &str = "
[twin]
model = \"tanks\"
[parameters]
upper_outflow = { value = 0.25, unit = \"m^0.5/s\" }
lower_inflow  = { value = 0.25, unit = \"m^0.5/s\" }
lower_outflow = { value = 0.2, unit = \"m^0.5/s\" }
pump_gain     = { value = 0.4, unit = \"m/s per unit\" }
[channels]
command = { column = \"u\" }
level   = { column = \"level\", unit = \"m\" }
";

/// Draws around the truth hold the recording, and draws beside it do not.
#[test]
fn cart_poles_and_tanks_are_rolled_out_over_draws() {
    let plants = [
        (SWINGING, swinging(), "cart_friction", ["0.4", "1.2"], ["0.0", "0.3"]),
        (FILLING, filling(), "upper_outflow", ["0.2", "0.4"], ["0.1", "0.2"]),
    ];
    for (twin, recording, parameter, around, beside) in plants {
        let scene = Folder::with(&[("rows.csv", &recording)]);
        for (name, [low, high]) in [("around", around), ("beside", beside)] {
            let drawn = format!(
                "[[randomize.parameter]]\nparameter = \"{parameter}\"\ndistribution = \"uniform\"\nlow = {low}\nhigh = {high}\n"
            );
            fs::write(scene.path(&format!("{name}.toml")), format!("{twin}{drawn}")).unwrap();
            let command = format!("rollout {name}.toml --recording rows.csv --draws 100 --out {name} --json");
            let (code, out, err) = scene.run(&command);
            assert_eq!(code, 0, "{err}");
            let rolled: Value = serde_json::from_str(&out).unwrap();
            assert_eq!(rolled["covered"], name == "around", "{parameter}, {name}: {rolled}");
            assert_eq!(rolled["drawn"][0]["name"], parameter);
            let draws = Table::read(scene.path(name).join("draws.parquet")).unwrap().floats(parameter).unwrap();
            let [low, high]: [f64; 2] = [low, high].map(|text| text.parse().unwrap());
            assert!(draws.len() == 100 && draws.iter().flatten().all(|value| (low..=high).contains(value)));
            let page = String::from_utf8(scene.bytes(&format!("{name}/report.html"))).unwrap();
            assert!(page.contains("var(--band)") && !page.contains("NaN"));
        }
    }
}

const EXECUTION: &str = "
[[randomize.parameter]]
mechanism = 'half_spread'
parameter = 'bps'
distribution = 'log_uniform'
low = 0.5
high = 2.0
relative = true
[[randomize.parameter]]
mechanism = 'command_delay'
parameter = 'seconds'
distribution = 'uniform'
low = 0.0
high = 60.0
[[randomize.correlation]]
between = ['half_spread.bps', 'command_delay.seconds']
coefficient = 0.5
";

#[test]
fn a_backtest_is_drawn_and_each_draw_is_what_a_backtest_of_it_is() {
    let scene = bars(EXECUTION);
    let found = scene.json("backtest run.toml --draws 40 --out d");
    let alone = scene.json("backtest run.toml");
    assert_eq!(found["metrics"], alone["metrics"], "the run as it is written is not touched");
    let draws = &found["draws"];
    assert_eq!((draws["draws"].as_u64(), draws["failed"].as_u64()), (Some(40), Some(0)), "{draws}");
    assert_eq!(draws["figures"]["total_return"]["nominal"], alone["metrics"]["total_return"]);
    let told = draws["figures"]["total_return"]["quantiles"].as_array().unwrap();
    let told: Vec<f64> = told.iter().map(|v| v.as_f64().unwrap()).collect();
    assert!(told.len() == 7 && told.windows(2).all(|w| w[0] <= w[1]) && told[0] < told[6], "{told:?}");

    let table = Table::read(scene.path("d/draws.parquet")).unwrap();
    let column = |name: &str| table.floats(name).unwrap().iter().map(|v| v.unwrap()).collect::<Vec<f64>>();
    let (spread, delay, gain) = (column("half_spread.bps"), column("command_delay.seconds"), column("total_return"));
    assert_eq!(spread.len(), 40);
    let run = fs::read_to_string(scene.path("run.toml")).unwrap();
    let run = run.split("[[randomize.parameter]]").next().unwrap().replace("bps = 1.0", &format!("bps = {:?}", spread[7]));
    let run = format!("{run}\n[[mechanism]]\nname = \"command_delay\"\nseconds = {:?}\n", delay[7]);
    fs::write(scene.path("seventh.toml"), run).unwrap();
    assert_eq!(scene.json("backtest seventh.toml")["metrics"]["total_return"].as_f64(), Some(gain[7]));

    let page = String::from_utf8(scene.bytes("d/report.html")).unwrap();
    assert!(page.contains("Randomized execution") && page.contains("var(--band)") && !page.contains("NaN"));
}

#[test]
fn draws_of_a_backtest_are_the_same_at_any_number_of_threads_and_nominal_at_level_0() {
    let scene = bars(&format!("[randomize]\nlevel = 1.0\n{EXECUTION}"));
    for (threads, out) in [(1, "a"), (3, "b")] {
        let ran = scene.run(&format!("backtest run.toml --draws 24 --out {out} --threads {threads}"));
        assert_eq!(ran.0, 0, "{}", ran.2);
    }
    for file in ["run.json", "draws.parquet", "report.html"] {
        assert_eq!(scene.bytes(&format!("a/{file}")), scene.bytes(&format!("b/{file}")), "{file}");
    }
    let run = fs::read_to_string(scene.path("run.toml")).unwrap();
    fs::write(scene.path("run.toml"), run.replace("level = 1.0", "level = 0.0")).unwrap();
    let none = scene.json("backtest run.toml --draws 8");
    for (name, figure) in none["draws"]["figures"].as_object().unwrap() {
        let all = figure["quantiles"].as_array().unwrap();
        assert!(all.iter().all(|v| v.as_f64() == figure["nominal"].as_f64()), "{name}: {figure}");
    }
}

#[test]
fn what_cannot_be_drawn_is_refused_with_what_to_do() {
    let plain = bars("");
    assert!(plain.refused("backtest run.toml --draws 10").contains("neither [randomize] nor [posterior]"));
    let within =
        bars(&EXECUTION.replacen("relative = true", "relative = true\nat = { seconds = 5.0 }", 1).replace("0.5\n", "0.1\n"));
    let told = within.refused("backtest run.toml --draws 10");
    // Correlated with what is drawn once, it is refused before anything else.
    assert!(told.contains("not drawn at the same time"), "{told}");
    let adds = bars(
        "[[randomize.parameter]]\nmechanism = 'half_sprad'\nparameter = 'bps'\ndistribution = 'uniform'\nlow = 0.5\nhigh = 2.0\n",
    );
    assert!(adds.refused("backtest run.toml --draws 10").contains("did you mean `half_spread`?"));
    let streamed = bars(EXECUTION);
    let run = fs::read_to_string(streamed.path("run.toml")).unwrap();
    fs::write(streamed.path("run.toml"), run.replace("seed = 7", "seed = 7\nstream = true")).unwrap();
    assert!(streamed.refused("backtest run.toml --draws 10").contains("stream"));
    let servo = servo();
    assert!(servo.refused("rollout twin.toml --recording test.csv").contains("neither [randomize] nor [posterior]"));
    let twin = fs::read_to_string(servo.path("twin.toml")).unwrap();
    let every = "\n[[randomize.parameter]]\nparameter = \"inertia\"\ndistribution = \"uniform\"\nlow = 0.1\nhigh = 0.12\nat = { steps = 10 }\n";
    fs::write(servo.path("twin.toml"), twin.clone() + every).unwrap();
    assert!(servo.refused("rollout twin.toml --recording test.csv").contains("drawn anew within a run"));
    let impossible = "\n[randomize]\npreset = [\"physics\"]\n[[randomize.correlation]]\nbetween = [\"inertia\", \"viscous_friction\"]\n\
                      coefficient = 0.9\n[[randomize.correlation]]\nbetween = [\"inertia\", \"coulomb_friction.torque\"]\n\
                      coefficient = 0.9\n[[randomize.correlation]]\nbetween = [\"viscous_friction\", \"coulomb_friction.torque\"]\n\
                      coefficient = -0.9\n";
    fs::write(servo.path("twin.toml"), twin + impossible).unwrap();
    let told = servo.refused("rollout twin.toml --recording test.csv");
    assert!(told.contains("not positive definite, its smallest eigenvalue is -0.8"), "{told}");
}

#[test]
fn a_trued_run_is_drawn_from_its_posterior() {
    let scene = bars("");
    // Orders of a market whose spread is three times what the run assumes.
    let run = fs::read_to_string(scene.path("run.toml")).unwrap();
    fs::write(scene.path("real.toml"), run.replace("bps = 1.0", "bps = 3.0")).unwrap();
    assert_eq!(scene.run("backtest real.toml --out log").0, 0);
    let diagnosed = scene.run("diagnose run.toml --recording log --out told");
    assert_eq!(diagnosed.0, 0, "{}", diagnosed.2);
    let drawn = scene.json("backtest told/trued.toml --draws 40 --out drawn");
    let spread = &drawn["draws"]["drawn"]["half_spread.bps"];
    let quantiles: Vec<f64> = spread["quantiles"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let trued = spread["nominal"].as_f64().unwrap();
    // Prices in whole ticks make a spread of 3 bps cost 3.2: that is what the fit finds, and draws lie around it.
    assert!((2.9..3.5).contains(&trued) && quantiles[0] < trued && trued < quantiles[6], "{spread}");
    assert!(quantiles[6] - quantiles[0] < 0.5, "{spread}");
}
