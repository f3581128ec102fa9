//! Environments from outside: what keeps their contract, and what is recorded of them.

mod check;
mod recording;
