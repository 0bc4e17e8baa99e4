//! The command line.
//!
//! Exit codes: 0 done, 1 something went wrong (the message says what and what to do: an unknown problem, a file that cannot be
//! written), 2 wrong arguments.

mod check;
mod compare;
mod output;
mod reproduce;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Design optimization of multibody systems by sequential approximation.
#[derive(Parser)]
#[command(version, about, max_term_width = 100)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Regenerate the tables and figures of a paper and put them beside the printed ones.
    Reproduce(reproduce::Reproduce),
    /// Run all methods on a problem of the library, or on all problems, and put them beside each other.
    Compare(compare::Compare),
    /// Prove the derivatives of a problem's responses against differences.
    Check(check::Check),
}

/// Reads the arguments, runs the command, reports an error in one line.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match arguments.command {
        Command::Reproduce(command) => command.run(),
        Command::Compare(command) => command.run(),
        Command::Check(command) => command.run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
