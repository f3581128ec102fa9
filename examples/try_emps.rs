#![allow(missing_docs, clippy::unwrap_used)]
use trueup::robot::*;
use trueup::sim2real::*;
fn read(p: &str, every: usize) -> Recording<Commands> {
    let s = std::fs::read_to_string(p).unwrap();
    let mut l = s.lines();
    let h: Vec<&str> = l.next().unwrap().split(',').collect();
    let c = |n: &str| h.iter().position(|x| *x == n).unwrap();
    let (ct, cf, cq) = (c("t"), c("force_n"), c("q_meas_m"));
    let rows: Vec<Vec<f64>> = l.step_by(every).map(|r| r.split(',').map(|v| v.parse().unwrap()).collect()).collect();
    Recording {
        name: p.rsplit('/').next().unwrap().into(),
        time: rows.iter().map(|r| r[ct]).collect(),
        stimulus: Commands(rows.iter().map(|r| r[cf]).collect()),
        measured: vec![Measured {
            channel: "position".into(),
            unit: "m".into(),
            samples: rows.iter().map(|r| Some(r[cq])).collect(),
        }],
    }
}
fn main() {
    let d = "/work/shared/data/robot/emps/";
    let tr = [read(&format!("{d}train.csv"), 1)];
    let te = [read(&format!("{d}test_pulses.csv"), 1)];
    let joint = Joint::new([100.0, 200.0, 0.0, 1.0], [0.2, 0.2, 0.0, 0.0]);
    let twin = Assembly::new(joint, MECHANISMS);
    let t0 = std::time::Instant::now();
    let out = diagnose::diagnose(&twin, &tr, &te, Seed(1), &|w, i, n| eprintln!("{:?} {w} {i}/{n}", t0.elapsed()));
    println!("{}", serde_json::to_string_pretty(&out.diagnosis).unwrap());
    println!("{:?}", t0.elapsed());
}
