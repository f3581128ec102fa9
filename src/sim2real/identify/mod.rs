//! Estimates of parameters from recordings.
