//! What a diagnosis leaves to print, to draw and to write.

use crate::io::TwinFile;
use crate::sim2real::diagnose::{Comparison, Diagnosis, Excitation, Profile};

use super::fitted::FittedTwin;

/// What a diagnosis leaves.
#[derive(Debug)]
pub(super) struct Diagnosed {
    /// The twin as it was taken.
    pub file: TwinFile,
    pub diagnosis: Diagnosis,
    /// The trued twin.
    pub trued: FittedTwin,
    pub comparisons: Vec<Comparison>,
    /// Errors over the states they may depend on.
    pub profiles: Vec<Profile>,
    /// The commands of the next experiment, where one was designed.
    pub excitation: Option<Excitation>,
}
