//! A case of either domain, from its drawing to its diagnosis.

use super::domain::Domain;
use super::seal::Sealed;
use super::trial::Trial;
use super::{joint, trading};
use crate::conceal::{Concealed, benchmark, trading as market};
use crate::market::LogError;
use crate::sim2real::Seed;

/// What was concealed, with all that a user would bring.
#[derive(Debug, Clone, PartialEq)]
pub enum Case {
    /// In a joint.
    Joint(Box<benchmark::Case>),
    /// In days of orders.
    Trading(Box<market::TradingCase>),
}

impl Case {
    /// Case `index` of `seed`: always the same.
    #[must_use]
    pub fn draw(domain: Domain, seed: Seed, index: usize) -> Self {
        match domain {
            Domain::Robot => Self::Joint(Box::new(benchmark::draw(seed, index))),
            Domain::Market => Self::Trading(Box::new(market::draw(seed, index))),
        }
    }

    /// Its label, sealed.
    ///
    /// # Errors
    /// None but a bug: a label is always JSON.
    pub fn sealed(&self, seed: Seed) -> Result<Sealed, serde_json::Error> {
        match self {
            Self::Joint(case) => Sealed::new(&case.label, case.label.index, seed),
            Self::Trading(case) => Sealed::new(&case.label, case.label.index, seed),
        }
    }

    /// Whether it is quicker drawn again than kept: its tables are long.
    #[must_use]
    pub fn is_large(&self) -> bool {
        matches!(self, Self::Trading(_))
    }

    /// Diagnoses it without a look at its label; the oracle alone is told, and only then. `clock` gives a time [s].
    ///
    /// # Errors
    /// None but a bug: what is generated can be read.
    pub fn tried(&self, clock: &(dyn Fn() -> f64 + Sync)) -> Result<Trial, LogError> {
        let names = |effects: &[Concealed]| effects.iter().map(|effect| effect.id.clone()).collect::<Vec<String>>();
        match self {
            Self::Joint(case) => {
                let names = names(&case.label.effects);
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                Ok(joint::given(case).tried(&names, || joint::regression(case), clock))
            }
            Self::Trading(case) => {
                let names = names(&case.label.effects);
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                let given = trading::given(case)?;
                Ok(given.tried(&names, || trading::regression(&given.train[0]), clock))
            }
        }
    }

    /// Diagnoses it as [`tried`](Self::tried) does, and asks neither the oracle nor the regression.
    ///
    /// # Errors
    /// None but a bug: what is generated can be read.
    pub fn answered(&self) -> Result<Trial, LogError> {
        Ok(match self {
            Self::Joint(case) => joint::given(case).answered(&|| 0.0).0,
            Self::Trading(case) => trading::given(case)?.answered(&|| 0.0).0,
        })
    }
}
