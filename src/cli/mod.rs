//! The command line: one file a subcommand.
//!
//! Results go to standard output; progress and what went wrong go to standard error. Exit codes: 0 done, 1 a finding the
//! caller asked to fail on, 2 bad input, 3 a bug.

mod answer;
mod audit;
mod backtest;
mod calibrate;
mod case;
mod checkpoint;
mod data;
mod demo;
mod diagnose;
mod diagnosed;
mod draws;
mod env;
mod figures;
mod fitted;
mod log_arguments;
mod mechanisms;
mod pace;
mod paper;
mod prove;
mod reconcile;
mod regimes;
mod regimes_output;
mod rollout;
mod screen;
mod stop;
mod sweep;
mod walk_forward;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub use answer::{Answer, Listener, Refusal, answer};
pub use backtest::strategy as strategy_of_run;

use screen::Screen;
use stop::{Outcome, Stop};

/// Finds what a simulation leaves out.
///
/// Where a simulator and a real recording differ, trueup says where, names the physics that is missing, models it, and
/// shows the fit improve on data it has not seen: for robot joints and for backtests of markets.
#[derive(Debug, Parser)]
#[command(name = "trueup", version, max_term_width = 110, after_help = AFTER_HELP)]
struct Line {
    /// Tell the progress on standard error even where that is not a terminal
    #[arg(long, global = true)]
    progress: bool,
    /// Number of threads to work with [default: all cores]; results do not depend on it
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Begin with `trueup demo`: it needs nothing but this program.

Exit codes: 0 done; 1 a finding the caller asked to fail on; 2 bad input; 3 a bug.";

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Demo),
    Diagnose(diagnose::Diagnose),
    Calibrate(calibrate::Calibrate),
    Rollout(rollout::Rollout),
    Backtest(backtest::Run),
    Paper(paper::Paper),
    Reconcile(reconcile::Reconcile),
    Audit(audit::Look),
    Sweep(sweep::Try),
    WalkForward(walk_forward::Walk),
    Regimes(regimes::Regimes),
    Mechanisms(mechanisms::Mechanisms),
    Prove(prove::Prove),
    Data(data::Data),
    Env(env::Env),
}

/// Runs the command line of this process.
#[must_use]
pub fn main() -> ExitCode {
    stop::silence_panics();
    run(std::env::args_os())
}

/// Runs the command line `arguments`, the first of which is the name of the program.
#[must_use]
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    let line = match Line::try_parse_from(arguments) {
        Ok(line) => line,
        Err(error) => {
            // Nobody is left to be told if even this cannot be written.
            let _ = error.print();
            return ExitCode::from(error.exit_code().clamp(0, 255) as u8);
        }
    };
    let outcome = stop::caught(|| {
        if let Some(threads) = line.threads {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.into());
            pool.build_global().map_err(|error| Stop::Bug(error.to_string()))?;
        }
        line.command.run(&Screen::new(line.progress))
    });
    stop::report(outcome)
}

impl Command {
    fn run(self, screen: &Screen) -> Result<Outcome, Stop> {
        match self {
            Self::Demo(command) => command.run(screen),
            Self::Diagnose(command) => command.run(screen),
            Self::Calibrate(command) => command.run(screen),
            Self::Rollout(command) => command.run(screen),
            Self::Backtest(command) => command.run(screen),
            Self::Paper(command) => command.run(screen),
            Self::Reconcile(command) => command.run(screen),
            Self::Audit(command) => command.run(screen),
            Self::Sweep(command) => command.run(screen),
            Self::WalkForward(command) => command.run(screen),
            Self::Regimes(command) => command.run(screen),
            Self::Mechanisms(command) => command.run(screen),
            Self::Prove(command) => command.run(screen),
            Self::Data(command) => command.run(screen),
            Self::Env(command) => command.run(screen),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Line::command().debug_assert();
    }
}
