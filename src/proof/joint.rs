//! Joints: what a user would bring, which is a twin and recordings and nothing that tells what is concealed, and a baseline.

mod regression;
mod terms;

use super::trial::Given;
use crate::conceal::Table;
use crate::conceal::benchmark::Case;
use crate::robot::{Axis, Commands, Joint, MECHANISMS};
use crate::sim2real::{Assembly, Measured, Recording};

pub(super) use regression::regression;

/// What a diagnosis is given of a case.
pub(super) fn given(case: &Case) -> Given<Joint> {
    let axis = if case.linear { Axis::Linear } else { Axis::Rotary };
    let unit = if case.linear { "m" } else { "rad" };
    Given {
        twin: Assembly::new(Joint::new(axis, case.nominal, case.uncertainty), MECHANISMS),
        train: [recording("train", &case.train, unit)],
        test: [recording("test", &case.test, unit)],
        channel: "position",
    }
}

fn recording(name: &str, table: &Table, unit: &str) -> Recording<Commands> {
    let column = |name| table.real(name).unwrap_or_default().to_vec();
    let samples = column("q").into_iter().map(Some).collect();
    Recording {
        name: name.to_owned(),
        time: column("t"),
        stimulus: Commands(column("u")),
        measured: vec![Measured { channel: "position".to_owned(), unit: unit.to_owned(), samples }],
    }
}
