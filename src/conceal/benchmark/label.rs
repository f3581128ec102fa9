//! What a case is told of after its diagnosis, and not before.

use serde::{Deserialize, Serialize};

use super::arm::Arm;
use crate::conceal::{Concealed, Kind};

/// The truth about a case.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Label {
    /// Number of the case.
    pub index: usize,
    /// What it is for.
    pub kind: Kind,
    /// What is concealed, by registries' names; empty where there is nothing, or nothing that a registry has.
    pub effects: Vec<Concealed>,
    /// What is concealed that no registry has, and its size [noise standard deviations].
    pub outside: Option<(String, f64)>,
    /// Names that are neither right nor wrong: a sensor whose noise is rounded does count in steps.
    pub tolerated: Vec<String>,
    /// The arm as it really is.
    pub arm: Arm,
    /// The arm as the twin has it.
    pub nominal: [f64; 4],
    /// Standard deviation of the noise [rad].
    pub noise: f64,
    /// Noise in words.
    pub noise_kind: String,
    /// Signal over noise [dB].
    pub snr: f64,
    /// How the arm was moved, in words: to learn from, and to test on.
    pub excitation: [String; 2],
}
