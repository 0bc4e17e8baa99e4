//! The command line.
//!
//! Exit codes: 0 done, 1 something went wrong (the message says what and what to do: an unknown problem, a mistake in a model
//! file, a file that cannot be written), 2 wrong arguments, 3 an optimization that ended without a solution.

mod check;
mod clock;
mod compare;
mod completion;
mod model;
mod output;
mod reproduce;
mod runs;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
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
  linkwright runs                     what has been run

`linkwright COMMAND --help` shows examples of a command."
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
    /// List past runs, or put two of them beside each other.
    Runs(runs::Runs),
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
    /// Print a script that makes a shell complete commands and options.
    Completion(completion::Completion),
    /// Read a model file, or take a problem of the library, and prove its derivatives against differences.
    Check(check::Check),
}

const CODES: &str =
    "Exit codes: 0 done, 1 an error (the message says what to do), 2 wrong arguments, 3 an optimization that
ended without a solution: cycle limit, stalled, or infeasible.";

/// The commands, each with the exit codes below its examples.
fn command() -> clap::Command {
    let with_codes = |command: clap::Command| {
        let help = command.get_after_help().map(|text| text.to_string() + "\n\n").unwrap_or_default();
        command.after_help(help + CODES)
    };
    with_codes(Arguments::command()).mut_subcommands(with_codes)
}

/// Reads the arguments, runs the command, reports an error in one line.
pub fn main() -> ExitCode {
    let matches = command().get_matches();
    let arguments = Arguments::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let done = |()| ExitCode::SUCCESS;
    let result = match arguments.command {
        Command::New(command) => command.run().map(done),
        Command::Completion(completion) => completion.run(&mut command()).map(done),
        Command::Check(command) => command.run().map(done),
        Command::Optimize(command) => command.run(),
        Command::Resume(command) => command.run(),
        Command::Runs(command) => command.run().map(done),
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
