//! The command line: flags as typed become a validated plan; one file a command.

mod args;
mod check;
mod choose;
#[cfg(feature = "rerun")]
mod compare;
#[cfg(feature = "rerun")]
mod export;
mod folder;
mod foresight;
#[cfg(feature = "rerun")]
mod info;
mod job;
#[cfg(feature = "rerun")]
mod keys;
mod lab;
mod mannequin;
mod output;
mod progress;
mod quantity;
#[cfg(feature = "rerun")]
mod replay;
mod report;
#[cfg(feature = "rerun")]
mod resume;
mod run;
mod scenes;
mod study;
#[cfg(feature = "rerun")]
mod verify;

use args::{Cli, Command};
use clap::Parser as _;
use std::process::ExitCode;

/// Why a command failed, and with which exit code.
#[derive(Debug)]
enum Failure {
    /// The run failed: 1.
    Run(anyhow::Error),
    /// Bad input: 2.
    Input(anyhow::Error),
}

impl Failure {
    /// Bad input, by an error whose message is complete: its source is not said again.
    fn input(error: impl std::fmt::Display) -> Self {
        Self::Input(anyhow::anyhow!("{error}"))
    }

    /// A failed run, by an error whose message is complete.
    fn run(error: impl std::fmt::Display) -> Self {
        Self::Run(anyhow::anyhow!("{error}"))
    }
}

/// Runs the program; the exit code is 0 when done, 1 when the run failed, 2 for bad input.
pub fn main() -> ExitCode {
    // Rerun reports trouble with its sinks only here.
    tracing_subscriber::fmt()
        .with_max_level(tracing::Level::WARN)
        .with_writer(std::io::stderr)
        .without_time()
        .init();
    let Cli { command, run } = Cli::parse();
    let done = match command.unwrap_or(Command::Run(run)) {
        Command::Run(args) => run::run(&args),
        Command::Scenes { name } => scenes::run(name.as_deref()),
        Command::Check(args) => check::run(&args),
        #[cfg(feature = "rerun")]
        Command::Resume(args) => resume::run(&args),
        #[cfg(feature = "rerun")]
        Command::Compare(args) => compare::run(&args),
        #[cfg(feature = "rerun")]
        Command::Verify(args) => verify::run(&args),
        #[cfg(feature = "rerun")]
        Command::Export(args) => export::run(&args),
        #[cfg(feature = "rerun")]
        Command::Replay(args) => replay::run(&args),
        #[cfg(feature = "rerun")]
        Command::Info(args) => info::run(&args),
        Command::Lab(args) => lab::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Mannequin { out, poncho } => mannequin::run(&out, poncho),
    };
    let (error, code) = match done {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Run(error)) => (error, 1),
        Err(Failure::Input(error)) => (error, 2),
    };
    eprintln!("error: {error:#}");
    ExitCode::from(code)
}
