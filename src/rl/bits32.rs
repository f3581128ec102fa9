//! Choices and rewards of 32 bits, as buffers of other libraries hold them.
//!
//! Of many lanes whose step takes some nanoseconds each, to turn them over takes a part that can be seen, so it is done with the
//! widest vectors the processor has: the bits are the same with any.

use pulp::{Arch, NullaryFnOnce};

/// Writes `choices`, one or more a lane, into `into`, whatever there was in it.
pub fn choices_of_32_bits(choices: &[i32], into: &mut Vec<i64>) {
    into.resize(choices.len(), 0);
    Arch::new().dispatch(Turned { from: choices, into, turn: i64::from });
}

/// Writes `rewards` into `into`, each to the nearest number of 32 bits; into as much of it as there are.
pub fn rewards_of_32_bits(rewards: &[f64], into: &mut [f32]) {
    Arch::new().dispatch(Turned { from: rewards, into, turn: |reward| reward as f32 });
}

struct Turned<'a, A, B, F> {
    from: &'a [A],
    into: &'a mut [B],
    turn: F,
}

impl<A: Copy, B, F: Fn(A) -> B> NullaryFnOnce for Turned<'_, A, B, F> {
    type Output = ();

    // What is not inlined here is compiled without the processor's vectors.
    #[inline(always)]
    fn call(self) {
        let Self { from, into, turn } = self;
        into.iter_mut().zip(from).for_each(|(into, from)| *into = turn(*from));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_turned_over_by_itself_however_many_there_are() {
        let mut choices = vec![7; 50];
        for count in [0, 1, 7, 100] {
            let short: Vec<i32> = (0..count).map(|k| if k % 2 == 0 { k } else { i32::MIN + k }).collect();
            choices_of_32_bits(&short, &mut choices);
            assert!(
                choices.len() == short.len() && choices.iter().zip(&short).all(|(long, short)| *long == i64::from(*short))
            );
        }
        let rewards: Vec<f64> = (0..37).map(|k| f64::from(k) / 7.0 - 2.0).chain([f64::NAN, 1e300]).collect();
        let mut single = vec![0.5; 40];
        rewards_of_32_bits(&rewards, &mut single);
        assert!(single.iter().zip(&rewards).all(|(single, reward)| single.to_bits() == (*reward as f32).to_bits()));
        assert!(single[37].is_nan() && single[38] == f32::INFINITY && single[39] == 0.5);
    }
}
