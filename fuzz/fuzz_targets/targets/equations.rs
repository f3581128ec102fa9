//! Expressions: each line is one. The last two are a derivative and an output, those before definitions `a`, `b`, ...

use trueup::robot::{Attachment, EquationSystem, Equations, InputVariable, OutputVariable, StateVariable};
use trueup::sim2real::Parameter;

use super::scene::{Scene, shown};

pub fn target(_: &Scene, bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let mut lines: Vec<String> = text.split('\n').map(str::to_owned).collect();
    let output = lines.pop().unwrap_or_default();
    let derivative = lines.pop().unwrap_or_default();
    let definitions = (b'a'..=b'j').zip(lines).map(|(name, text)| (char::from(name).to_string(), text));
    let state = |name: &str| StateVariable { name: name.into(), unit: String::new(), initial: 0.5, std: None };
    let system = EquationSystem {
        states: vec![state("x"), state("v")],
        inputs: vec![InputVariable { name: "u".into(), unit: String::new(), interpolated: false }],
        parameters: vec![Parameter::new("k", "", 2.0).known_to(0.1)],
        rates: vec![("x".into(), "v".into()), ("v".into(), derivative)],
        discrete: false,
        outputs: vec![OutputVariable { name: "y".into(), unit: String::new(), expression: output.clone() }],
        definitions: definitions.collect(),
        attach: None,
    };
    let attach = Some(Attachment { position: "x".into(), velocity: "v".into(), inertia: output });
    shown(Equations::new(EquationSystem { attach, ..system.clone() }, 1e-3));
    if let Some(equations) = shown(Equations::new(system, 1e-3)) {
        let _ = equations.not_finite_at_start(&[1.0]);
    }
}
