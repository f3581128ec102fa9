//! The library of sparse regression: what each mechanism would add to the acceleration, as far as rows show it.

use std::f64::consts::TAU;

use nalgebra::DVector;

use crate::proof::selection::Term;

/// Smoothed motion and command at one row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Row {
    pub index: usize,
    pub time: f64,
    pub command: f64,
    pub command_rate: f64,
    pub position: f64,
    pub velocity: f64,
    pub acceleration: f64,
    /// The command some time ago.
    pub delayed: [f64; 3],
}

/// Speeds below this part of the usual one are rest.
const REST: f64 = 0.03;

/// All terms, mechanisms with inner numbers once for each value of a grid.
pub(super) fn library(rows: &[Row], linear: bool) -> Vec<Term> {
    let usual =
        |of: fn(&Row) -> f64| (rows.iter().map(|row| of(row).powi(2)).sum::<f64>() / rows.len().max(1) as f64).sqrt();
    let (speed, command) = (usual(|row| row.velocity).max(1e-9), usual(|row| row.command).max(1e-9));
    let side = move |row: &Row| (row.velocity / (REST * speed)).tanh();
    let mut terms = Terms { rows, terms: Vec::new() };
    terms.add("coulomb_friction", &[&side]);
    terms.add("stribeck_friction", &[&side, &|row| side(row) * (-(row.velocity / (0.15 * speed)).powi(2)).exp()]);
    terms.add("load_friction", &[&|row| side(row) * row.command.abs()]);
    terms.add("quadratic_drag", &[&|row| row.velocity * row.velocity.abs()]);
    terms.add("constant_load", &[&|_| 1.0]);
    terms.add("stiffness", &[&|row| row.position]);
    terms.add("cubic_stiffness", &[&|row| row.position.powi(3)]);
    terms.add("actuator_lag", &[&|row| row.command_rate]);
    terms.add("bias", &[&|row| row.position.cos()]);
    terms.add("drift", &[&|row| row.time * row.position.cos()]);
    terms.add("scale", &[&|row| row.position * row.position.cos()]);
    for k in 0..3 {
        terms.add("command_delay", &[&|row| row.delayed[k] - row.command]);
    }
    for part in [0.15, 0.35, 0.7, 1.1] {
        let width = part * command;
        terms.add("dead_zone", &[&|row| row.command.clamp(-width, width)]);
        terms.add("saturation", &[&|row| row.command - row.command.clamp(-1.6 * width, 1.6 * width)]);
    }
    cogging(&mut terms, linear);
    payload(&mut terms);
    end_stops(&mut terms);
    with_memory(&mut terms, command);
    terms.terms
}

struct Terms<'a> {
    rows: &'a [Row],
    terms: Vec<Term>,
}

impl Terms<'_> {
    fn add(&mut self, id: &'static str, of: &[&dyn Fn(&Row) -> f64]) {
        let columns = of.iter().map(|of| DVector::from_iterator(self.rows.len(), self.rows.iter().map(of))).collect();
        self.terms.push(Term { id, columns });
    }
}

fn cogging(terms: &mut Terms<'_>, linear: bool) {
    let counts: Vec<f64> =
        if linear { (4..13).map(|k| TAU / (0.005 * f64::from(k))).collect() } else { (3..17).map(f64::from).collect() };
    for count in counts {
        terms.add("cogging", &[&|row| (count * row.position).sin(), &|row| (count * row.position).cos()]);
    }
}

fn payload(terms: &mut Terms<'_>) {
    let end = terms.rows.last().map_or(0.0, |row| row.time);
    for k in 2..18 {
        let since = end * f64::from(k) / 20.0;
        let there = move |row: &Row| f64::from(u8::from(row.time > since));
        // More inertia weakens everything else.
        let less = |of: fn(&Row) -> f64| move |row: &Row| there(row) * of(row);
        terms.add("payload_change", &[&less(|r| r.command), &less(|r| r.velocity), &less(|r| r.position.sin())]);
    }
}

fn end_stops(terms: &mut Terms<'_>) {
    for side in [1.0, -1.0] {
        let most = terms.rows.iter().fold(0.0, |most: f64, row| most.max(side * row.position));
        for part in [0.5, 0.7, 0.85, 0.93, 0.97] {
            terms.add("end_stop", &[&|row| (side * row.position - part * most).max(0.0)]);
        }
    }
}

/// Terms that depend on the past: yielding springs, heat, slewing.
fn with_memory(terms: &mut Terms<'_>, command: f64) {
    let rows = terms.rows;
    let step = rows.windows(2).next().map_or(0.004, |w| w[1].time - w[0].time);
    let first = rows.first().map_or(0, |row| row.index);
    let stride = rows.windows(2).next().map_or(1, |w| w[1].index - w[0].index).max(1);
    let at = move |row: &Row| (row.index - first) / stride;
    let reach = rows.iter().fold(0.0, |most: f64, row| most.max(row.position.abs()));
    for part in [0.1, 0.3] {
        let most = part * reach;
        let bent: Vec<f64> = rows
            .windows(2)
            .scan(0.0, |bent: &mut f64, w| {
                *bent = (*bent + w[1].position - w[0].position).clamp(-most, most);
                Some(*bent)
            })
            .collect();
        terms.add("hysteresis", &[&|row| at(row).checked_sub(1).map_or(0.0, |k| bent[k])]);
    }
    for settling in [2.0, 5.0] {
        let heat = followed(rows, |heat, row| heat + step / settling * ((row.command / command).powi(2) - heat));
        terms.add("thermal_derating", &[&|row| row.command * heat[at(row)]]);
    }
    for rate in [3.0, 8.0, 20.0] {
        let most = rate * command * step;
        let slewed = followed(rows, |slewed, row| slewed + (row.command - slewed).clamp(-most, most));
        terms.add("rate_limit", &[&|row| row.command - slewed[at(row)]]);
    }
}

fn followed(rows: &[Row], next: impl Fn(f64, &Row) -> f64) -> Vec<f64> {
    rows.iter()
        .scan(0.0, |value, row| {
            *value = next(*value, row);
            Some(*value)
        })
        .collect()
}
