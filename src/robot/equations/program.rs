//! Expressions made ready to be evaluated over all lanes at once.

use std::collections::HashMap;

use super::expression::{Expression, FUNCTIONS, FUNCTIONS_OF_TWO, Operator};

/// What an instruction does with its operands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Op {
    Add,
    Subtract,
    Multiply,
    Divide,
    Negate,
    Power,
    Of(usize),
    OfTwo(usize),
}

/// `slot[to] = op(slot[left], slot[right])`; operands always stand before `to`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Instruction {
    op: Op,
    left: usize,
    right: usize,
    to: usize,
}

/// Expressions as instructions on slots, each of which holds one number a lane: first what is given (`fixed` names, then
/// `varying` ones), then constants, then what the instructions make. What depends on `fixed` names alone is computed once
/// a run; what stands in several expressions, once.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Program {
    constants: Vec<(usize, f64)>,
    once: Vec<Instruction>,
    each: Vec<Instruction>,
    /// The slots of the expressions' values.
    outputs: Vec<usize>,
    slots: usize,
}

/// A program under construction: slots that are given, hold a constant, or the result of an instruction.
#[derive(Default)]
struct Builder<'a> {
    /// What a name stands for.
    named: HashMap<&'a str, usize>,
    constants: Vec<(usize, f64)>,
    /// Slots of the constants, by their bits.
    known_constants: HashMap<u64, usize>,
    instructions: Vec<Instruction>,
    /// Slots of their results, by what they do with which operands.
    known_results: HashMap<(Op, usize, usize), usize>,
    /// Of each slot, whether it is the same throughout a run.
    lasting: Vec<bool>,
}

impl Program {
    /// A program that computes `expressions` from the `fixed` names, whose values stay throughout a run, and the `varying`
    /// ones; slot `k` is that of the `k`-th of both. Each of the `definitions` may use those before it.
    ///
    /// # Errors
    /// The first name in them that stands for nothing.
    pub fn compile(
        fixed: &[String],
        varying: &[String],
        definitions: &[(String, Expression)],
        expressions: &[&Expression],
    ) -> Result<Self, String> {
        let named = fixed.iter().chain(varying).enumerate().map(|(slot, name)| (name.as_str(), slot)).collect();
        let lasting = fixed.iter().map(|_| true).chain(varying.iter().map(|_| false)).collect();
        let mut builder = Builder { named, lasting, ..Builder::default() };
        for (name, definition) in definitions {
            let slot = builder.add(definition)?;
            builder.named.insert(name, slot);
        }
        let outputs = expressions.iter().map(|e| builder.add(e)).collect::<Result<Vec<usize>, String>>()?;
        let Builder { constants, instructions, lasting, .. } = builder;
        let (once, each) = instructions.into_iter().partition(|instruction| lasting[instruction.to]);
        Ok(Self { constants, once, each, outputs, slots: lasting.len() })
    }

    /// Memory for `lanes` lanes, in which the fixed names have the values of `fixed`, a row a name.
    pub fn memory<'a>(&self, lanes: usize, fixed: impl IntoIterator<Item = &'a [f64]>) -> Memory {
        let width = if lanes == 1 { 1 } else { lanes.next_multiple_of(BLOCK) };
        let mut memory = Memory { lanes, width, values: vec![0.0; self.slots * width] };
        for (slot, values) in fixed.into_iter().enumerate() {
            memory.slot_mut(slot).copy_from_slice(values);
        }
        for (slot, value) in &self.constants {
            memory.slot_mut(*slot).fill(*value);
        }
        self.once.iter().for_each(|instruction| memory.execute(*instruction));
        memory
    }

    /// Computes the expressions from what stands in the slots of the varying names.
    pub fn run(&self, memory: &mut Memory) {
        if memory.width == 1 {
            self.each.iter().for_each(|instruction| memory.execute_alone(*instruction));
        } else {
            self.each.iter().for_each(|instruction| memory.execute(*instruction));
        }
    }

    /// The value of expression `k`, one a lane.
    pub fn output<'m>(&self, memory: &'m Memory, k: usize) -> &'m [f64] {
        memory.slot(self.outputs[k])
    }
}

/// Lanes that an instruction takes at once.
const BLOCK: usize = 4;

/// The slots of a program over lanes.
#[derive(Debug, Clone, Default)]
pub(super) struct Memory {
    lanes: usize,
    /// Numbers a slot holds: whole blocks of lanes, of which the last may be idle.
    width: usize,
    values: Vec<f64>,
}

impl Memory {
    /// The values of a slot, one a lane.
    pub fn slot(&self, slot: usize) -> &[f64] {
        &self.values[slot * self.width..][..self.lanes]
    }

    /// As [`slot`](Self::slot), to be written.
    pub fn slot_mut(&mut self, slot: usize) -> &mut [f64] {
        &mut self.values[slot * self.width..][..self.lanes]
    }

    /// As [`execute`](Self::execute) does it for a single lane, without the room of a block.
    fn execute_alone(&mut self, Instruction { op, left, right, to }: Instruction) {
        let (left, right) = (self.values[left], self.values[right]);
        self.values[to] = match op {
            Op::Add => left + right,
            Op::Subtract => left - right,
            Op::Multiply => left * right,
            Op::Divide => left / right,
            Op::Negate => -left,
            Op::Power => left.powf(right),
            Op::Of(function) => FUNCTIONS[function].1(left),
            Op::OfTwo(function) => FUNCTIONS_OF_TWO[function].1(left, right),
        };
    }

    fn execute(&mut self, Instruction { op, left, right, to }: Instruction) {
        let width = self.width;
        let (before, from) = self.values.split_at_mut(to * width);
        let result = &mut from[..width];
        let (left, right) = (&before[left * width..][..width], &before[right * width..][..width]);
        match op {
            Op::Add => in_blocks(result, left, right, |a, b| a + b),
            Op::Subtract => in_blocks(result, left, right, |a, b| a - b),
            Op::Multiply => in_blocks(result, left, right, |a, b| a * b),
            Op::Divide => in_blocks(result, left, right, |a, b| a / b),
            Op::Negate => in_blocks(result, left, right, |a, _| -a),
            // Functions are called lane by lane: not for idle ones.
            Op::Power => lane_by_lane(&mut result[..self.lanes], left, right, f64::powf),
            Op::Of(function) => {
                let function = FUNCTIONS[function].1;
                lane_by_lane(&mut result[..self.lanes], left, right, |a, _| function(a));
            }
            Op::OfTwo(function) => {
                lane_by_lane(&mut result[..self.lanes], left, right, FUNCTIONS_OF_TWO[function].1);
            }
        }
    }
}

#[inline]
fn in_blocks(result: &mut [f64], left: &[f64], right: &[f64], function: impl Fn(f64, f64) -> f64) {
    if let ([result], [left], [right]) = (&mut *result, left, right) {
        *result = function(*left, *right);
        return;
    }
    let operands = left.as_chunks::<BLOCK>().0.iter().zip(right.as_chunks::<BLOCK>().0);
    for (result, (left, right)) in result.as_chunks_mut::<BLOCK>().0.iter_mut().zip(operands) {
        *result = std::array::from_fn(|k| function(left[k], right[k]));
    }
}

#[inline]
fn lane_by_lane(result: &mut [f64], left: &[f64], right: &[f64], function: impl Fn(f64, f64) -> f64) {
    result.iter_mut().zip(left.iter().zip(right)).for_each(|(result, (left, right))| *result = function(*left, *right));
}

impl Builder<'_> {
    fn add(&mut self, expression: &Expression) -> Result<usize, String> {
        Ok(match expression {
            Expression::Number(value) => self.constant(*value),
            Expression::Name(name) => self.named.get(name.as_str()).copied().ok_or_else(|| name.clone())?,
            Expression::Negative(one) => {
                let one = self.add(one)?;
                self.result(Op::Negate, one, one)
            }
            Expression::Of(function, one) => {
                let one = self.add(one)?;
                self.result(Op::Of(*function), one, one)
            }
            Expression::OfTwo(function, left, right) => {
                let (left, right) = (self.add(left)?, self.add(right)?);
                self.result(Op::OfTwo(*function), left, right)
            }
            Expression::Join(Operator::Power, base, exponent) => {
                let base = self.add(base)?;
                match **exponent {
                    // Products are faster than a general power, and exact for whole exponents.
                    Expression::Number(whole) if whole.fract() == 0.0 && (1.0..=8.0).contains(&whole) => {
                        (1..whole as usize).fold(base, |power, _| self.result(Op::Multiply, power, base))
                    }
                    _ => {
                        let exponent = self.add(exponent)?;
                        self.result(Op::Power, base, exponent)
                    }
                }
            }
            Expression::Join(operator, left, right) => {
                let (left, right) = (self.add(left)?, self.add(right)?);
                let op = match operator {
                    Operator::Add => Op::Add,
                    Operator::Subtract => Op::Subtract,
                    Operator::Multiply => Op::Multiply,
                    Operator::Divide => Op::Divide,
                    Operator::Power => Op::Power,
                };
                self.result(op, left, right)
            }
        })
    }

    fn constant(&mut self, value: f64) -> usize {
        let Self { lasting, constants, known_constants, .. } = self;
        *known_constants.entry(value.to_bits()).or_insert_with(|| {
            lasting.push(true);
            constants.push((lasting.len() - 1, value));
            lasting.len() - 1
        })
    }

    fn result(&mut self, op: Op, left: usize, right: usize) -> usize {
        let Self { lasting, instructions, known_results, .. } = self;
        *known_results.entry((op, left, right)).or_insert_with(|| {
            let to = lasting.len();
            lasting.push(lasting[left] && lasting[right]);
            instructions.push(Instruction { op, left, right, to });
            to
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(names: &[&str]) -> Vec<String> {
        names.iter().map(|name| (*name).to_owned()).collect()
    }

    #[test]
    fn computes_every_lane_and_what_lasts_only_once() {
        let definitions = [("spring".to_owned(), Expression::parse("k3*x^3").unwrap())];
        let texts = ["(k*u - d*v - spring)/m", "sqrt(k/m)*v + 2*pi", "max(x, 0)^1.5", "v"];
        let expressions = texts.map(|text| Expression::parse(text).unwrap());
        let (fixed, varying) = (names(&["m", "d", "k", "k3"]), names(&["u", "x", "v"]));
        let program = Program::compile(&fixed, &varying, &definitions, &expressions.each_ref()).unwrap();
        // sqrt(k/m) and 2*pi.
        assert_eq!(program.once.len(), 3);
        let parameters: [[f64; 2]; 4] = [[1.5, 2.0], [0.2, 0.3], [4.0, 5.0], [0.7, 0.8]];
        let mut memory = program.memory(2, parameters.iter().map(<[f64; 2]>::as_slice));
        for (u, x, v) in [(0.3, 1.2, -0.4), (-1.0, 0.5, 2.0)] {
            for (slot, value) in [(4, u), (5, x), (6, v)] {
                memory.slot_mut(slot).copy_from_slice(&[value, 2.0 * value]);
            }
            program.run(&mut memory);
            for lane in 0..2 {
                let [m, d, k, k3] = parameters.map(|row| row[lane]);
                let [u, x, v] = [u, x, v].map(|value: f64| value * (lane + 1) as f64);
                let expected = [
                    (k * u - d * v - k3 * (x * x * x)) / m,
                    (k / m).sqrt() * v + 2.0 * std::f64::consts::PI,
                    x.max(0.0).powf(1.5),
                    v,
                ];
                for (output, expected) in expected.into_iter().enumerate() {
                    assert_eq!(program.output(&memory, output)[lane], expected, "{}", texts[output]);
                }
            }
        }
        let unknown = Expression::parse("k*w").unwrap();
        assert_eq!(Program::compile(&fixed, &varying, &[], &[&unknown]), Err("w".to_owned()));
    }
}
