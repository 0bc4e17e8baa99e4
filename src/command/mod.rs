//! The command line.
//!
//! | file | command or subject |
//! |---|---|
//! | `new`, `check`, `analyze`, `optimize`, `report`, `runs`, `compare`, `reproduce` | one command each; `optimize` has `resume`, `analyze` has `sensitivities`, `new` has `schema` and `completion` |
//! | `import` | robots of URDF and MJCF files as model files |
//! | `study` | `study FILE` and `study merge DIR…`; the folder of a study |
//! | `database` | the database of runs: `runs --db`, `optimize --warm`, feature `database` |
//! | `open` | the interactive design tool, feature `app` |
//! | `run_directory` | the files of a run, safe against a kill at any moment |
//! | `run_entry` | runs and studies below folders |
//! | `output_folder` | folders into which commands write, with the list of their files |
//! | `budget` | memory and time, estimated from the sizes of a problem |
//! | `progress`, `eta` | the table of cycles during a run, and the estimated time to its end |
//! | `interruption` | Ctrl-C |
//! | `analysis_page`, `report_pair` | the page of an analysis, the page of two runs |
//! | `tables` | cycles, histories and derivatives as tables |
//! | `model`, `output` | reading of model files; standard output and standard error, dates and durations |
//!
//! Exit codes: 0 done, 1 an error (such as an unknown problem, a mistake in a model file, a file that cannot be written; the
//! message says what to do), 2 wrong arguments, 3 an optimization that ended without a solution,
//! 130 interrupted by Ctrl-C.

mod analysis_page;
mod analyze;
#[cfg(test)]
#[path = "../../fuzz/src/any_folder.rs"]
mod any_folder;
mod budget;
mod check;
mod compare;
#[cfg(feature = "database")]
mod database;
mod eta;
#[cfg(test)]
mod faults;
mod import;
mod interruption;
mod model;
mod new;
#[cfg(feature = "app")]
mod open;
pub(crate) mod optimize;
mod output;
mod output_folder;
mod progress;
pub(crate) mod report;
mod report_pair;
mod reproduce;
pub(crate) mod run_directory;
pub(crate) mod run_entry;
pub(crate) mod runs;
mod study;
mod tables;

use output::{ClosedOutput, complain};

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::io::ErrorKind;
use std::process::ExitCode;

/// Design optimization of multibody systems by sequential approximation.
#[derive(Parser)]
#[command(
    version,
    about,
    max_term_width = 100,
    after_help = "Examples:
  linkwright new lift                 write a model file with comments
  linkwright open lift                try designs in the browser
  linkwright optimize lift.toml       optimize it
  linkwright report out/lift          write a report for a browser
  linkwright resume out/lift          continue an interrupted run
  linkwright runs                     list past runs

`linkwright COMMAND --help` shows examples of a command."
)]
struct Arguments {
    /// Let a model file start the program that it names (look at both before)
    #[arg(long, global = true)]
    allow_programs: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Write a commented model file to start from.
    New(new::New),
    /// Make a model file from a robot in a URDF or MJCF file.
    Import(import::Import),
    /// Open a model file in the browser: move its design variables and see the mechanism and the margins follow.
    #[cfg(feature = "app")]
    Open(open::Open),
    /// Optimize the problem of a model file.
    Optimize(optimize::Optimize),
    /// Continue an optimization from its folder.
    Resume(optimize::Resume),
    /// List past runs, or compare two of them.
    Runs(runs::Runs),
    /// Do many runs of a model file: samples, many starts, sweeps, tolerances, Pareto fronts, sensitivity indices.
    Study(study::Study),
    /// Write the report of a run: one page for a browser, and its figures.
    Report(report::Report),
    /// Analyse one design of a model file.
    Analyze(analyze::Analyze),
    /// Compute the derivatives at one design of a model file.
    Sensitivities(analyze::Sensitivities),
    /// Print the JSON schema of model files, for editors.
    Schema(new::Schema),
    /// Compute the tables of a paper and compare them with the printed ones; draw its figures.
    Reproduce(reproduce::Reproduce),
    /// Compare all methods on a problem of the library, on all its problems, or on a model file.
    Compare(compare::Compare),
    /// Print a script that makes a shell complete commands and options.
    Completion(new::Completion),
    /// Check a model file or a problem of the library, and its derivatives by finite differences.
    Check(check::Check),
}

const CODES: &str =
    "Exit codes: 0 done, 1 an error (the message says what to do), 2 wrong arguments, 3 an optimization that
ended without a solution: cycle limit, stalled, or infeasible, 130 interrupted by Ctrl-C.";

/// The commands, each with the exit codes below its examples.
fn command() -> clap::Command {
    let with_codes = |command: clap::Command| {
        let help = command.get_after_help().map(|text| text.to_string() + "\n\n").unwrap_or_default();
        command.after_help(help + CODES)
    };
    with_codes(Arguments::command()).mut_subcommands(with_codes)
}

/// Reads the arguments, runs the command, and prints an error to standard error.
pub fn main() -> ExitCode {
    let matches = command().try_get_matches();
    let arguments = match matches.and_then(|matches| Arguments::from_arg_matches(&matches)) {
        Ok(arguments) => arguments,
        Err(asked) => return told(&asked),
    };
    if arguments.allow_programs {
        model::allow_programs();
    }
    interruption::handle();
    start_threads();
    let done = |()| ExitCode::SUCCESS;
    // The output of these commands is all that they do.
    let only_prints = matches!(arguments.command, Command::Runs(_) | Command::Schema(_) | Command::Completion(_));
    let result = match arguments.command {
        Command::New(command) => command.run().map(done),
        Command::Import(command) => command.run().map(done),
        Command::Completion(completion) => completion.run(&mut command()).map(done),
        Command::Check(command) => command.run().map(done),
        #[cfg(feature = "app")]
        Command::Open(command) => command.run().map(done),
        Command::Optimize(command) => command.run(),
        Command::Resume(command) => command.run(),
        Command::Runs(command) => command.run().map(done),
        Command::Study(command) => command.run(),
        Command::Report(command) => command.run().map(done),
        Command::Analyze(command) => command.run().map(done),
        Command::Sensitivities(command) => command.run().map(done),
        Command::Schema(command) => command.run().map(done),
        Command::Reproduce(command) => command.run().map(done),
        Command::Compare(command) => command.run().map(done),
    };
    result.unwrap_or_else(|error| {
        if only_prints && error.is::<ClosedOutput>() {
            return ExitCode::SUCCESS;
        }
        complain(&format!("error: {error:#}"));
        ExitCode::FAILURE
    })
}

/// Prints the help that was asked for, or what is wrong with the arguments. A pager may close help before its end.
fn told(asked: &clap::Error) -> ExitCode {
    match asked.print() {
        Err(why) if !asked.use_stderr() && why.kind() != ErrorKind::BrokenPipe => {
            complain(&format!("error: cannot write to standard output: {why}"));
            ExitCode::FAILURE
        }
        _ => ExitCode::from(asked.exit_code() as u8),
    }
}

/// Threads for each processor that RAYON_NUM_THREADS can ask for.
const THREADS: usize = 16;

/// Starts the threads of parallel loops: as many as RAYON_NUM_THREADS says, or one for each processor. A system that cannot start
/// them gets fewer; results do not depend on their number.
fn start_threads() {
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    let wanted = std::env::var("RAYON_NUM_THREADS").ok().and_then(|count| count.trim().parse().ok());
    let mut count = wanted.filter(|count| *count > 0).unwrap_or(processors).min(THREADS * processors);
    while count > 1 && rayon::ThreadPoolBuilder::new().num_threads(count).build_global().is_err() {
        count /= 2;
    }
    if count == 1 {
        drop(rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    /// The options of all commands that work, with the name of their command.
    fn options() -> BTreeMap<String, Vec<clap::Arg>> {
        let mut found = BTreeMap::new();
        for command in command().get_subcommands() {
            let own = |command: &clap::Command| command.get_opts().filter(|arg| !arg.is_hide_set()).cloned().collect();
            found.insert(command.get_name().to_owned(), own(command));
            for inner in command.get_subcommands() {
                found.insert(format!("{} {}", command.get_name(), inner.get_name()), own(inner));
            }
        }
        found
    }

    /// Every option with one name has one short form, one value and one meaning in all commands that have it.
    #[test]
    fn all_commands_have_one_grammar() {
        let all = options();
        let has = |command: &str, option: &str| all[command].iter().any(|arg| arg.get_long() == Some(option));
        // Commands that have an option; all others have a reason: they print a text that is their only output, or serve a page.
        let models = ["analyze", "sensitivities", "check", "optimize", "resume", "compare", "study"];
        let budgets = [&models[..], &["report"]].concat();
        let files =
            ["analyze", "sensitivities", "check", "optimize", "compare", "runs", "report", "reproduce", "study"];
        let printing = [&files[..], &["resume", "study merge"]].concat();
        let numbers: Vec<&str> = printing.iter().copied().filter(|c| !["report", "reproduce"].contains(c)).collect();
        for (option, commands) in [
            ("set", &models[..]),
            ("memory", &budgets),
            ("out", &files),
            ("json", &printing),
            ("quiet", &printing),
            ("digits", &numbers),
        ] {
            for command in commands {
                assert!(has(command, option), "{command} has no --{option}");
            }
        }
        let mut first: BTreeMap<String, (String, Option<char>, String)> = BTreeMap::new();
        for (command, options) in &all {
            for arg in options {
                let name = arg.get_long().expect("every option has a long name").to_owned();
                let value = arg.get_value_names().unwrap_or_default().join(" ");
                let (with, short, same) =
                    first.entry(name.clone()).or_insert_with(|| (command.clone(), arg.get_short(), value.clone()));
                assert_eq!((arg.get_short(), &value), (*short, &*same), "--{name} of {command} and {with}");
                assert!(arg.get_help().is_some_and(|help| !help.to_string().is_empty()), "--{name} of {command}");
                let aliases = arg.get_visible_aliases().unwrap_or_default();
                match &*name {
                    "at" => assert_eq!(aliases, ["start"], "{command}"),
                    "start" => assert_eq!(aliases, ["at"], "{command}"),
                    _ => {}
                }
            }
        }
    }

    #[test]
    fn the_help_of_every_command_shows_examples_and_exit_codes() {
        for command in command().get_subcommands() {
            let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
            let inner = command.get_name() == "study";
            assert!(help.contains("Examples:") || inner, "{}", command.get_name());
            assert!(help.contains("130 interrupted"), "{}", command.get_name());
        }
    }
}
