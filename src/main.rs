//! The `linkwright` command: arguments in, exit code out, no mathematics.

use std::process::ExitCode;

fn main() -> ExitCode {
    linkwright::command::main()
}
