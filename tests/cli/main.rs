//! The command line as its users meet it.

#![cfg(feature = "cli")]

mod account_files;
mod audit;
mod bad_input;
mod bad_twins;
mod command_scene;
mod commands;
mod data_import;
mod env;
mod halts;
mod log_symbols;
mod loop_scene;
#[cfg(unix)]
mod paper;
mod prove;
mod randomize;
mod reconcile;
mod regimes;
mod run;
mod run_as_twin;
mod run_spy;
#[cfg(unix)]
mod session_scene;
mod sweep;
mod turns;
mod unread;
mod walk_forward;
