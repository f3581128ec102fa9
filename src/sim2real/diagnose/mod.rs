//! Locate, name, model, prove: what a simulator left out, found from recordings.

mod diagnosis;

pub use diagnosis::{
    ChannelFit, Checks, Diagnosis, Effect, Estimate, Interval, NextExperiment, ParameterChange, Rival, SCHEMA, Score,
    Verdict, Where,
};
