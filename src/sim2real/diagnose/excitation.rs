//! Commands that an experiment could send: sines of many frequencies, ramps, steps, pulses and chirps, of several sizes.

use std::f64::consts::TAU;

use rand::RngExt;

use crate::sim2real::Seed;

/// Commands to send, and when.
#[derive(Debug, Clone, PartialEq)]
pub struct Excitation {
    /// What it is, in words ("sines of 0.2 to 2 Hz").
    pub name: String,
    /// Time of each command [s], from 0.
    pub time: Vec<f64>,
    /// The commands, each in force until the next, in the unit of the command.
    pub command: Vec<f64>,
}

/// Sizes, as parts of what the recordings used: the largest is as far beyond it as a person will go unasked.
const SIZES: [f64; 4] = [0.15, 0.5, 1.0, 1.5];
/// Sines of one signal.
const TONES: usize = 8;
/// Digits of a command behind the leading one of the largest: a file says exactly what was simulated.
const DIGITS: i32 = 4;

/// A shape between -1 and 1 over a time that runs from 0 to 1.
type Shape<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

/// The family of commands over `rows` rows `spacing` [s] apart, between the largest multiples of `range`, what the recordings used.
pub(super) fn family(rows: usize, spacing: f64, range: [f64; 2], seed: Seed) -> Vec<Excitation> {
    let duration = rows as f64 * spacing;
    let fastest = 0.06 / spacing;
    let slowest = 1.5 / duration;
    let middle = (slowest * fastest).sqrt();
    let mut shapes: Vec<(String, Shape<'_>)> = Vec::new();
    for (k, (low, high)) in
        [(slowest, 0.3 * middle), (slowest, middle), (0.3 * middle, 3.0 * middle), (middle, fastest)].into_iter().enumerate()
    {
        shapes.push((format!("sines of {} to {} Hz", figure(low), figure(high)), sines(low, high, duration, seed, k)));
    }
    for turns in [1.0, 4.0] {
        let name = format!("ramps up and down in {} s", figure(duration / turns));
        shapes.push((name, Box::new(move |x| triangle(turns * x))));
    }
    for hold in [duration / 10.0, duration / 40.0] {
        let name = format!("random levels held for {} s", figure(hold));
        shapes.push((name, levels(duration / hold, seed)));
    }
    for period in [duration / 6.0, duration / 20.0] {
        let name = format!("pulses of either sign every {} s, at rest between them", figure(period));
        let count = duration / period;
        shapes.push((name, Box::new(move |x| pulse(x * count))));
    }
    let name = format!("a sine from {} to {} Hz", figure(slowest), figure(fastest));
    let ratio = fastest / slowest;
    // Phase of a frequency that grows by the same factor in equal times.
    shapes.push((name, Box::new(move |x| (TAU * slowest * duration / ratio.ln() * (ratio.powf(x) - 1.0)).sin())));
    let time: Vec<f64> = (0..rows).map(|i| (i as f64 * spacing * 1e9).round() / 1e9).collect();
    let [low, high] = range;
    let (mut center, mut half) = (0.5 * (low + high), 0.5 * (high - low));
    // About 0 where the recordings were nearly so: rest is where dry friction and dead zones show.
    if center.abs() < 0.3 * half {
        (center, half) = (0.0, low.abs().max(high.abs()));
    }
    let places = (f64::from(DIGITS) - (center.abs() + half).log10().floor()).clamp(0.0, 12.0) as usize;
    let mut all = Vec::new();
    for (name, shape) in &shapes {
        for size in SIZES {
            let value = |x: f64| {
                let command = center + size * half * shape(x).clamp(-1.0, 1.0);
                // What was never sent with the other sign, as a flow into a tank, may not have one.
                let command = if low >= 0.0 { command.max(0.0) } else { command };
                format!("{command:.places$}").parse().unwrap_or(command)
            };
            let command = (0..rows).map(|i| value(i as f64 / rows as f64)).collect();
            let reach = super::words::figure(size * half, 3);
            let about = if center == 0.0 { String::new() } else { format!(" about {}", super::words::figure(center, 3)) };
            all.push(Excitation { name: format!("{name}, up to {reach}{about}"), time: time.clone(), command });
        }
    }
    all
}

fn figure(value: f64) -> String {
    super::words::figure(value, 2)
}

/// Sines evenly spaced in the logarithm, with phases that keep their peaks apart (Schroeder, IEEE Transactions on Information
/// Theory 16 (1970)) shifted at random.
fn sines(low: f64, high: f64, duration: f64, seed: Seed, number: usize) -> Shape<'static> {
    let mut rng = seed.stream("next experiment sines");
    let shift: Vec<f64> = (0..TONES * (number + 1)).map(|_| rng.random::<f64>()).collect();
    let tones: Vec<(f64, f64)> = (0..TONES)
        .map(|k| {
            let frequency = low * (high / low).powf(k as f64 / (TONES - 1) as f64);
            let schroeder = 0.5 * (k * k) as f64 / TONES as f64;
            (TAU * frequency * duration, TAU * (schroeder + shift[TONES * number + k]))
        })
        .collect();
    // Higher tones are smaller, as a servo's commands are.
    let weight = |k: usize| 1.0 / (1.0 + k as f64 / 3.0);
    let sum =
        move |x: f64| tones.iter().enumerate().map(|(k, (rate, phase))| weight(k) * (rate * x + phase).sin()).sum::<f64>();
    let peak = (0..2_000).map(|i| sum(f64::from(i) / 2_000.0).abs()).fold(0.0, f64::max);
    Box::new(move |x| sum(x) / peak)
}

/// Up from 0 to 1, down to -1 and back, once in a turn.
fn triangle(turns: f64) -> f64 {
    let phase = (turns + 0.25).rem_euclid(1.0);
    1.0 - 4.0 * (phase - 0.5).abs()
}

/// Random levels, every fourth of them 0.
fn levels(count: f64, seed: Seed) -> Shape<'static> {
    let mut rng = seed.stream("next experiment levels");
    let number = count.ceil() as usize + 1;
    let levels: Vec<f64> = (0..number).map(|k| if k % 4 == 3 { 0.0 } else { rng.random_range(-1.0..1.0) }).collect();
    let largest = levels.iter().fold(0.0_f64, |m, l| m.max(l.abs())).max(1e-12);
    Box::new(move |x| levels[((x * count) as usize).min(number - 1)] / largest)
}

/// Half of the time at rest; the pulses change their sign and grow over four of them.
fn pulse(turns: f64) -> f64 {
    let number = turns as i64;
    let size = 0.25 * (1 + (number / 2) % 4) as f64;
    let sign = if number % 2 == 0 { 1.0 } else { -1.0 };
    if turns.fract() < 0.5 { sign * size } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_stay_within_one_and_a_half_times_what_was_used() {
        let all = family(2_000, 0.01, [-2.0, 1.9], Seed(3));
        assert!(all.len() >= 40);
        for signal in &all {
            let largest = signal.command.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
            assert!(largest <= 3.0 && largest > 0.2, "{}: {largest}", signal.name);
            assert!(signal.command.len() == 2_000 && signal.time[1_999] == 19.99, "{}", signal.name);
        }
        let pump = family(500, 4.0, [0.0, 8.0], Seed(3));
        assert!(pump.iter().flat_map(|s| &s.command).all(|u| (0.0..=10.0).contains(u)));
        assert_eq!(family(500, 4.0, [0.0, 8.0], Seed(3)), pump);
    }

    #[test]
    fn shapes_have_their_turning_points() {
        assert_eq!([0.0, 0.25, 0.5, 0.75].map(triangle), [0.0, 1.0, 0.0, -1.0]);
        assert_eq!([0.1, 0.6, 1.1, 6.1].map(pulse), [0.25, 0.0, -0.25, 1.0]);
    }
}
