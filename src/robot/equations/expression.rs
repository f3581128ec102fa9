//! Arithmetic as a user writes it in a document: `(k*u - d*v)/m`.
//!
//! Precedence is that of mathematics: `-x^2` is `-(x^2)`, `2^3^2` is `2^9`.

use std::fmt;

/// A name that expressions have for something.
type Named<T> = (&'static str, T);
type OfOne = fn(f64) -> f64;
type OfTwo = fn(f64, f64) -> f64;

/// A function of one number.
pub(super) const FUNCTIONS: [Named<OfOne>; 17] = [
    ("sin", f64::sin),
    ("cos", f64::cos),
    ("tan", f64::tan),
    ("asin", f64::asin),
    ("acos", f64::acos),
    ("atan", f64::atan),
    ("sinh", f64::sinh),
    ("cosh", f64::cosh),
    ("tanh", f64::tanh),
    ("exp", f64::exp),
    ("ln", f64::ln),
    ("log10", f64::log10),
    ("sqrt", f64::sqrt),
    ("abs", f64::abs),
    ("floor", f64::floor),
    ("sign", sign),
    ("step", step),
];

/// A function of two numbers.
pub(super) const FUNCTIONS_OF_TWO: [Named<OfTwo>; 4] =
    [("min", f64::min), ("max", f64::max), ("atan2", f64::atan2), ("hypot", f64::hypot)];

/// Names that stand for a number.
pub(super) const CONSTANTS: [Named<f64>; 1] = [("pi", std::f64::consts::PI)];

/// `sign(0) = 0`, as in mathematics.
fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}

/// 1 where `x > 0`, 0 elsewhere.
fn step(x: f64) -> f64 {
    f64::from(u8::from(x > 0.0))
}

/// What joins two expressions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
}

/// An expression as it was parsed; functions by their number in [`FUNCTIONS`] and [`FUNCTIONS_OF_TWO`].
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Expression {
    Number(f64),
    Name(String),
    Negative(Box<Self>),
    Of(usize, Box<Self>),
    OfTwo(usize, Box<Self>, Box<Self>),
    Join(Operator, Box<Self>, Box<Self>),
}

/// Why a text is no expression.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct NoExpression {
    /// What is wrong, with the place.
    pub message: String,
    /// What to do about it.
    pub hint: String,
}

impl fmt::Display for NoExpression {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

/// Longest expression [characters]: a longer one is split by definitions.
const LONGEST: usize = 2_000;

/// How deep parentheses and functions may stand in one another: deeper ones are no physics, but could exhaust the stack.
const DEEPEST: usize = 100;

impl Expression {
    /// The expression that `text` is.
    pub fn parse(text: &str) -> Result<Self, NoExpression> {
        if text.len() > LONGEST {
            let message = format!("expected an expression of at most {LONGEST} characters, found {}", text.len());
            return Err(NoExpression { message, hint: "split it by `[definitions]`".to_owned() });
        }
        let mut parser = Parser { text, at: 0, depth: 0 };
        let whole = parser.sum()?;
        match parser.peek() {
            None => Ok(whole),
            Some(c) if c.is_alphanumeric() || c == '(' || c == '_' => {
                Err(parser.wrong("expected an operator", "a product is written with `*`, as in `2*x`"))
            }
            Some(_) => {
                Err(parser.wrong("expected an operator", "there are `+`, `-`, `*`, `/`, `^` and functions, as `sin(x)`"))
            }
        }
    }

    /// Every name in it, in the order in which they stand, again where one stands again.
    pub fn names(&self) -> Vec<&str> {
        let mut names = Vec::new();
        self.collect(&mut names);
        names
    }

    fn collect<'a>(&'a self, names: &mut Vec<&'a str>) {
        match self {
            Self::Number(_) => {}
            Self::Name(name) => names.push(name),
            Self::Negative(one) | Self::Of(_, one) => one.collect(names),
            Self::OfTwo(_, left, right) | Self::Join(_, left, right) => {
                left.collect(names);
                right.collect(names);
            }
        }
    }
}

/// Whether expressions have the name for something of their own: a function, a constant, the time.
pub(super) fn reserved(name: &str) -> bool {
    let functions = FUNCTIONS.iter().map(|(own, _)| *own).chain(FUNCTIONS_OF_TWO.iter().map(|(own, _)| *own));
    name == "t" || functions.chain(CONSTANTS.iter().map(|(own, _)| *own)).any(|own| own == name)
}

/// Whether a name can stand in an expression.
pub(super) fn is_name(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_') && chars.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// A parser by recursive descent, one method a precedence.
struct Parser<'a> {
    text: &'a str,
    /// Byte that is read next.
    at: usize,
    depth: usize,
}

impl Parser<'_> {
    fn peek(&mut self) -> Option<char> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start().len();
        self.text[self.at..].chars().next()
    }

    fn take(&mut self, wanted: char) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += if found { wanted.len_utf8() } else { 0 };
        found
    }

    fn wrong(&mut self, message: &str, hint: &str) -> NoExpression {
        let found = match self.peek() {
            None => "the end".to_owned(),
            Some(c) => format!("`{c}` at character {}", self.text[..self.at].chars().count() + 1),
        };
        NoExpression { message: format!("{message}, found {found} in `{}`", self.text), hint: hint.to_owned() }
    }

    fn sum(&mut self) -> Result<Expression, NoExpression> {
        let mut left = self.product()?;
        loop {
            let operator = if self.take('+') {
                Operator::Add
            } else if self.take('-') {
                Operator::Subtract
            } else {
                return Ok(left);
            };
            left = Expression::Join(operator, Box::new(left), Box::new(self.product()?));
        }
    }

    fn product(&mut self) -> Result<Expression, NoExpression> {
        let mut left = self.signed()?;
        loop {
            let operator = if self.take('*') {
                if self.peek() == Some('*') {
                    return Err(self.wrong("expected a factor", "a power is written with `^`, as in `x^2`"));
                }
                Operator::Multiply
            } else if self.take('/') {
                Operator::Divide
            } else {
                return Ok(left);
            };
            left = Expression::Join(operator, Box::new(left), Box::new(self.signed()?));
        }
    }

    fn signed(&mut self) -> Result<Expression, NoExpression> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(self.wrong("too many parentheses and signs within one another", "split it by `[definitions]`"));
        }
        let signed = if self.take('-') {
            Expression::Negative(Box::new(self.signed()?))
        } else if self.take('+') {
            self.signed()?
        } else {
            self.power()?
        };
        self.depth -= 1;
        Ok(signed)
    }

    fn power(&mut self) -> Result<Expression, NoExpression> {
        let base = self.atom()?;
        if !self.take('^') {
            return Ok(base);
        }
        // The exponent takes signs and further powers, so that `2^-1` and `2^3^2` are what they look like.
        Ok(Expression::Join(Operator::Power, Box::new(base), Box::new(self.signed()?)))
    }

    fn atom(&mut self) -> Result<Expression, NoExpression> {
        match self.peek() {
            Some('(') => {
                self.at += 1;
                let inner = self.sum()?;
                self.close()?;
                Ok(inner)
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.name(),
            _ => Err(self.wrong("expected a number, a name or `(`", "an expression is like `(k*u - d*v)/m`")),
        }
    }

    fn close(&mut self) -> Result<(), NoExpression> {
        if self.take(')') { Ok(()) } else { Err(self.wrong("expected `)`", "each `(` needs a `)`")) }
    }

    fn number(&mut self) -> Result<Expression, NoExpression> {
        let bytes = self.text.as_bytes();
        let digits = |mut at: usize| {
            while bytes.get(at).is_some_and(|b| b.is_ascii_digit() || *b == b'.') {
                at += 1;
            }
            at
        };
        let mut end = digits(self.at);
        // An exponent is one where digits follow: `2e` alone is not.
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            let exponent = digits(end + 1 + sign);
            end = if exponent > end + 1 + sign { exponent } else { end };
        }
        match self.text[self.at..end].parse::<f64>() {
            Ok(value) if value.is_finite() => {
                self.at = end;
                Ok(Expression::Number(value))
            }
            _ => Err(self.wrong("expected a number", "numbers are like `2`, `0.5` and `1e-3`")),
        }
    }

    fn name(&mut self) -> Result<Expression, NoExpression> {
        let rest = &self.text[self.at..];
        let end = rest.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(rest.len());
        let name = &rest[..end];
        let constant = CONSTANTS.iter().find(|(own, _)| *own == name).map(|(_, value)| *value);
        let of_one = FUNCTIONS.iter().position(|(own, _)| *own == name);
        let of_two = FUNCTIONS_OF_TWO.iter().position(|(own, _)| *own == name);
        self.at += end;
        let open = self.take('(');
        if of_one.is_none() && of_two.is_none() {
            if open {
                let all: Vec<&str> = FUNCTIONS.iter().map(|(own, _)| *own).collect();
                return Err(NoExpression {
                    message: format!("there is no function `{name}` in `{}`", self.text),
                    hint: format!("there are {}, min, max, atan2 and hypot; a product needs a `*`", all.join(", ")),
                });
            }
            return Ok(constant.map_or_else(|| Expression::Name(name.to_owned()), Expression::Number));
        }
        if !open {
            return Err(self.wrong(&format!("expected `(` after the function `{name}`"), "a function is like `sin(x)`"));
        }
        let first = self.sum()?;
        let parsed = match (of_one, of_two) {
            (Some(function), _) => Expression::Of(function, Box::new(first)),
            (_, Some(function)) => {
                if !self.take(',') {
                    return Err(self.wrong(&format!("`{name}` is of two numbers"), "write it like `max(x, 0)`"));
                }
                Expression::OfTwo(function, Box::new(first), Box::new(self.sum()?))
            }
            _ => first,
        };
        self.close()?;
        Ok(parsed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(text: &str) -> f64 {
        fn of(expression: &Expression) -> f64 {
            match expression {
                Expression::Number(value) => *value,
                Expression::Name(name) => {
                    if name == "x" {
                        3.0
                    } else {
                        f64::NAN
                    }
                }
                Expression::Negative(one) => -of(one),
                Expression::Of(function, one) => FUNCTIONS[*function].1(of(one)),
                Expression::OfTwo(function, left, right) => FUNCTIONS_OF_TWO[*function].1(of(left), of(right)),
                Expression::Join(operator, left, right) => match operator {
                    Operator::Add => of(left) + of(right),
                    Operator::Subtract => of(left) - of(right),
                    Operator::Multiply => of(left) * of(right),
                    Operator::Divide => of(left) / of(right),
                    Operator::Power => of(left).powf(of(right)),
                },
            }
        }
        of(&Expression::parse(text).unwrap())
    }

    #[test]
    fn precedence_is_that_of_mathematics() {
        for (text, expected) in [
            ("-2^2", -4.0),
            ("-x^2", -9.0),
            ("2^-1", 0.5),
            ("2^3^2", 512.0),
            ("8/4/2", 1.0),
            ("1 - 2 - 3", -4.0),
            ("2*-x", -6.0),
            ("1e-3*x", 3e-3),
            ("1.5E2 + .5", 150.5),
            ("(1 + 2)*3", 9.0),
            ("max(1, x) + min(1, x)", 4.0),
            ("sin(0)^2 + cos(0)^2", 1.0),
            ("2*pi", std::f64::consts::TAU),
            ("sign(-x) + sign(0) + step(x)", 0.0),
            ("+x", 3.0),
        ] {
            assert_eq!(value(text), expected, "{text}");
        }
    }

    #[test]
    fn what_is_no_expression_is_told_with_place_and_remedy() {
        let told = |text: &str| {
            let error = Expression::parse(text).unwrap_err();
            format!("{}\n  hint: {}", error.message, error.hint)
        };
        let texts = ["(x + 1", "2x", "x**2", "sinn(x)", "sin x", "max(1)", "x +", "", "x = 1", "1.2.3"];
        insta::assert_snapshot!(texts.map(told).join("\n"));
        assert!(told(&"(".repeat(1_000)).contains("within one another"));
        assert!(told(&"-".repeat(1_000)).contains("within one another"));
        assert!(told(&"x + ".repeat(100_000)).contains("split it"));
    }

    proptest! {
        #[test]
        fn no_text_stops_the_parser(text in "[-+*/^()., a-z0-9_é]{0,40}") {
            let _ = Expression::parse(&text);
        }
    }
}
