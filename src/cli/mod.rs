//! The command line.
//!
//! Exit codes: 0 done, 1 something went wrong (the message says what and what to do: an unknown problem, a file that cannot be
//! written), 2 wrong arguments, 3 an optimization that ended without a solution.

mod check;
mod compare;
mod model;
mod output;
mod reproduce;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Design optimization of multibody systems by sequential approximation.
#[derive(Parser)]
#[command(
    version,
    about,
    max_term_width = 100,
    after_help = "Examples:
  linkwright new lift                 a commented model file
  linkwright optimize lift.toml       optimize it
  linkwright report out/lift          look at it in a browser
  linkwright resume out/lift          go on where it was stopped

Exit codes: 0 done, 1 an error, 2 wrong arguments, 3 an optimization that ended without a solution."
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write a commented model file to start from.
    New(model::New),
    /// Optimize the problem of a model file.
    Optimize(model::Optimize),
    /// Continue an optimization from its folder.
    Resume(model::Resume),
    /// Write the report of a run: one page for a browser, and its figures.
    Report(model::Report),
    /// Analyse one design of a model file.
    Analyze(model::Analyze),
    /// Differentiate one design of a model file.
    Sensitivities(model::Sensitivities),
    /// Print the JSON schema of model files, for editors.
    Schema(model::Schema),
    /// Regenerate the tables and figures of a paper and put them beside the printed ones.
    Reproduce(reproduce::Reproduce),
    /// Run all methods on a problem of the library, or on all problems, and put them beside each other.
    Compare(compare::Compare),
    /// Read a model file, or take a problem of the library, and prove its derivatives against differences.
    Check(check::Check),
}

/// Reads the arguments, runs the command, reports an error in one line.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let done = |()| ExitCode::SUCCESS;
    let result = match arguments.command {
        Command::New(command) => command.run().map(done),
        Command::Check(command) => command.run().map(done),
        Command::Optimize(command) => command.run(),
        Command::Resume(command) => command.run(),
        Command::Report(command) => command.run().map(done),
        Command::Analyze(command) => command.run().map(done),
        Command::Sensitivities(command) => command.run().map(done),
        Command::Schema(command) => command.run().map(done),
        Command::Reproduce(command) => command.run().map(done),
        Command::Compare(command) => command.run().map(done),
    };
    match result {
        Ok(code) => code,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
