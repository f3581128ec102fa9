//! What a user would bring: a twin and recordings, and nothing that tells what is concealed.

use crate::conceal::Table;
use crate::conceal::benchmark::Case;
use crate::robot::{Axis, Commands, Joint, MECHANISMS};
use crate::sim2real::{Assembly, Measured, Recording};

/// The twin of a case.
#[must_use]
pub fn twin(case: &Case) -> Assembly<Joint> {
    let axis = if case.linear { Axis::Linear } else { Axis::Rotary };
    Assembly::new(Joint::new(axis, case.nominal, case.uncertainty), MECHANISMS)
}

/// Its recordings: to learn from, and to test on.
#[must_use]
pub fn recordings(case: &Case) -> [Recording<Commands>; 2] {
    let unit = if case.linear { "m" } else { "rad" };
    [("train", &case.train), ("test", &case.test)].map(|(name, table)| recording(name, table, unit))
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
