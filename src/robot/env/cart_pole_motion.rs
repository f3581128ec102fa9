//! The motion of cart-poles side by side: loops over many lanes that compilers turn into vector instructions.

#![allow(clippy::needless_range_loop, reason = "one index for many rows is what becomes vector instructions")]

use crate::robot::sine::sine;

use super::row::Row;

/// Lanes that are stepped at once: what is known of them between one loop and the next stays close to the processor.
pub(super) const TILE: usize = 64;

/// The same of lanes that fill no tile; what is left of them goes one by one.
pub(super) const SMALL_TILE: usize = 8;

/// The parameters as the equations have them. With a cart of mass `M`, a pole of mass `m` and half length `l`:
#[derive(Debug, Clone)]
pub(super) struct Constants {
    /// `M + m` [kg].
    mass: Constant,
    /// `0.75 m` [kg].
    swinging: Constant,
    /// `m l` [kg m].
    lever: Constant,
    /// `m g` [N].
    weight: Constant,
    /// `c / l` of the hinge's friction `c` [N s/rad].
    hinge: Constant,
    /// Friction of the cart [N s/m].
    friction: Constant,
    /// `0.75 / l` [1/m].
    turning: Constant,
    /// `1 / m` [1/kg].
    lightness: Constant,
    /// Gain [N per unit of command].
    gain: Constant,
}

/// A number for each lane of a tile, from the beginning of a cache line on, as in a [`Row`].
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Tile<const N: usize>(pub [f64; N]);

/// One number for all lanes, or one for each.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant, reason = "there are nine of them in all, and what a loop reads lies beside it")]
enum Constant {
    Same(Tile<TILE>),
    Own(Row),
}

impl Constant {
    fn new(value: f64, lanes: Option<usize>) -> Self {
        lanes.map_or(Self::Same(Tile([value; TILE])), |lanes| Self::Own(Row::new(value, lanes)))
    }

    /// Those of `count` lanes from lane `first`.
    #[inline(always)]
    fn of(&self, first: usize, count: usize) -> &[f64] {
        match self {
            Self::Same(tile) => &tile.0[..count],
            Self::Own(values) => &values[first..first + count],
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, value: f64) {
        if let Self::Own(values) = self {
            values[lane] = value;
        }
    }
}

impl Constants {
    /// Those of `lanes` lanes with these `values` of all of [`CartPole`](crate::robot::CartPole)'s parameters, of which the lanes have
    /// their own of those for which `differs`.
    pub fn new(values: &[f64], lanes: usize, differs: impl Fn(usize) -> bool) -> Self {
        let [mass, swinging, lever, weight, hinge, friction, turning, lightness, gain] = derived(values);
        let made = |value, of: &[usize]| Constant::new(value, of.iter().any(|k| differs(*k)).then_some(lanes));
        Self {
            mass: made(mass, &[0, 1]),
            swinging: made(swinging, &[1]),
            lever: made(lever, &[1, 2]),
            weight: made(weight, &[1, 3]),
            hinge: made(hinge, &[2, 5]),
            friction: made(friction, &[4]),
            turning: made(turning, &[2]),
            lightness: made(lightness, &[1]),
            gain: made(gain, &[6]),
        }
    }

    /// Sets lane `lane` to these values of the parameters, as far as lanes have their own.
    #[inline]
    pub fn set(&mut self, lane: usize, values: &[f64]) {
        for (constant, value) in self.all().into_iter().zip(derived(values)) {
            constant.set(lane, value);
        }
    }

    /// Makes lane `to` a copy of lane `from` of `other`, or of its own where there is none.
    pub fn copy(&mut self, other: Option<&Self>, from: usize, to: usize) {
        let values = other.unwrap_or(self).lane(from);
        self.all().into_iter().zip(values).for_each(|(own, value)| own.set(to, value));
    }

    /// Those of lane `lane`.
    fn lane(&self, lane: usize) -> [f64; 9] {
        let Self { mass, swinging, lever, weight, hinge, friction, turning, lightness, gain } = self;
        let of = |constant: &Constant| match constant {
            Constant::Same(tile) => tile.0[0],
            Constant::Own(values) => values[lane],
        };
        [mass, swinging, lever, weight, hinge, friction, turning, lightness, gain].map(of)
    }

    fn all(&mut self) -> [&mut Constant; 9] {
        let Self { mass, swinging, lever, weight, hinge, friction, turning, lightness, gain } = self;
        [mass, swinging, lever, weight, hinge, friction, turning, lightness, gain]
    }
}

/// The constants of these values of the parameters, in their order.
#[inline(always)]
fn derived(values: &[f64]) -> [f64; 9] {
    let [cart, pole, half, gravity, friction, hinge, gain] = std::array::from_fn(|k| values[k]);
    [cart + pole, 0.75 * pole, pole * half, pole * gravity, hinge / half, friction, 0.75 / half, 1.0 / pole, gain]
}

/// Angles up to this size [rad] have a short way to their sine: all that a pole under way has.
const SHORT: f64 = 0.3;

/// Sine and cosine of each angle [rad]. A lane's bits do not depend on its neighbours' angles.
#[inline(always)]
fn sines(angles: &[f64], sin: &mut [f64], cos: &mut [f64]) {
    let count = angles.len();
    let (sin, cos) = (&mut sin[..count], &mut cos[..count]);
    let mut short = true;
    for k in 0..count {
        let q = angles[k];
        let z = q * q;
        let z2 = z * z;
        let z4 = z2 * z2;
        // Taylor's series; what is left out is below 3e-17 within the short way.
        let low = (1.0 - z * (1.0 / 6.0)) + z2 * (1.0 / 120.0 - z * (1.0 / 5_040.0));
        sin[k] = q * (low + z4 * (1.0 / 362_880.0 - z * (1.0 / 39_916_800.0)));
        let low = (1.0 - z * 0.5) + z2 * (1.0 / 24.0 - z * (1.0 / 720.0));
        cos[k] = low + z4 * ((1.0 / 40_320.0 - z * (1.0 / 3_628_800.0)) + z2 * (1.0 / 479_001_600.0));
        short &= q.abs() <= SHORT;
    }
    if !short {
        long(angles, sin, cos);
    }
}

#[cold]
#[inline(never)]
fn long(angles: &[f64], sin: &mut [f64], cos: &mut [f64]) {
    for ((angle, sin), cos) in angles.iter().zip(sin).zip(cos) {
        if angle.abs() > SHORT || angle.is_nan() {
            *sin = sine(*angle);
            *cos = sine(*angle + std::f64::consts::FRAC_PI_2);
        }
    }
}

/// Speeds are cut off here [m/s, rad/s]: none under way is near it, and one whose episode is over stays finite.
const FASTEST: f64 = 1e4;

/// What lanes go through in a step, one number each: cart position [m] and velocity [m/s], pole angle [rad] and angular velocity
/// [rad/s], each in an argument of its own, of which compilers know that it does not overlap with another.
///
/// A step of Euler's method [s] of the `N` lanes from lane `first` on, under these commands.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "see above")]
pub(super) fn advance<const N: usize>(
    position: &mut [f64],
    velocity: &mut [f64],
    angle: &mut [f64],
    spin: &mut [f64],
    commands: &[f64; N],
    constants: &Constants,
    first: usize,
    step: f64,
) {
    let (mut sin, mut cos) = (Tile([0.0; N]), Tile([0.0; N]));
    sines(angle, &mut sin.0, &mut cos.0);
    let (c, count) = (constants, position.len());
    // One by one: a loop over them may be a function of its own, which is called for every tile.
    let (mass, swinging, lever) = (c.mass.of(first, count), c.swinging.of(first, count), c.lever.of(first, count));
    let (weight, hinge, friction) = (c.weight.of(first, count), c.hinge.of(first, count), c.friction.of(first, count));
    let (turning, lightness, gain) = (c.turning.of(first, count), c.lightness.of(first, count), c.gain.of(first, count));
    euler(
        position, velocity, angle, spin, commands, &sin.0, &cos.0, mass, swinging, lever, weight, hinge, friction, turning,
        lightness, gain, step,
    );
}

#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "as above")]
#[expect(clippy::manual_clamp, reason = "a clamp keeps what is no number, and is no single instruction")]
fn euler(
    position: &mut [f64],
    velocity: &mut [f64],
    angle: &mut [f64],
    spin: &mut [f64],
    commands: &[f64],
    sin: &[f64],
    cos: &[f64],
    mass: &[f64],
    swinging: &[f64],
    lever: &[f64],
    weight: &[f64],
    hinge: &[f64],
    friction: &[f64],
    turning: &[f64],
    lightness: &[f64],
    gain: &[f64],
    step: f64,
) {
    let count = position.len();
    // As long as one another, or compilers ask at every lane.
    let (velocity, angle, spin) = (&mut velocity[..count], &mut angle[..count], &mut spin[..count]);
    let (commands, sin, cos) = (&commands[..count], &sin[..count], &cos[..count]);
    let (mass, swinging, lever, weight) = (&mass[..count], &swinging[..count], &lever[..count], &weight[..count]);
    let (hinge, friction, turning) = (&hinge[..count], &friction[..count], &turning[..count]);
    let (lightness, gain) = (&lightness[..count], &gain[..count]);
    for k in 0..count {
        let (speed, turn) = (velocity[k], spin[k]);
        let leaning = weight[k] * sin[k] - hinge[k] * turn;
        let reaction = lever[k] * turn * turn * sin[k] - 0.75 * cos[k] * leaning;
        let inertia = mass[k] - swinging[k] * cos[k] * cos[k];
        let acceleration = (gain[k] * commands[k] - friction[k] * speed + reaction) / inertia;
        let turned = turning[k] * (leaning * lightness[k] - cos[k] * acceleration);
        position[k] += step * speed;
        angle[k] += step * turn;
        velocity[k] = (speed + step * acceleration).max(-FASTEST).min(FASTEST);
        spin[k] = (turn + step * turned).max(-FASTEST).min(FASTEST);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_and_long_ways_are_sines() {
        let (mut sin, mut cos) = ([0.0; TILE], [0.0; TILE]);
        for tile in 0..500 {
            let angles: [f64; TILE] =
                std::array::from_fn(|k| (tile * TILE + k) as f64 * 5e-5 * if k % 2 == 0 { 1.0 } else { -1.0 });
            sines(&angles, &mut sin, &mut cos);
            for (k, q) in angles.iter().enumerate() {
                assert!((sin[k] - q.sin()).abs() < 5e-16 && (cos[k] - q.cos()).abs() < 5e-16, "{q}");
            }
        }
        // What is beside an angle changes no bit of its sine.
        sines(&[0.1; 5], &mut sin, &mut cos);
        let alone = sin[0];
        sines(&[0.1, 3.0, -2.0, f64::NAN, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1], &mut sin, &mut cos);
        assert!([0, 4, 8, 10].iter().all(|k| sin[*k].to_bits() == alone.to_bits()));
    }

    #[test]
    fn constants_that_do_not_differ_are_kept_once_and_others_for_each_lane() {
        let values = [1.0, 0.1, 0.5, 9.8, 0.0, 0.0, 10.0];
        for parameter in 0..7 {
            let mut some = Constants::new(&values, 3, |k| k == parameter);
            let mut all = Constants::new(&values, 3, |_| true);
            let mut other = values;
            other[parameter] *= 1.5;
            other[parameter] += 0.01;
            some.set(1, &other);
            all.set(1, &other);
            some.copy(None, 1, 2);
            all.copy(Some(&some), 1, 2);
            for (some, all) in some.all().into_iter().zip(all.all()) {
                assert_eq!(some.of(0, 2), all.of(0, 2), "parameter {parameter}");
                if matches!(some, Constant::Own(_)) {
                    assert_eq!(some.of(1, 2), [all.of(1, 1)[0]; 2]);
                }
            }
        }
    }
}
