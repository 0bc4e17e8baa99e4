//! The `linkwright` command: arguments in, exit code out, no mathematics.

mod command;

fn main() -> std::process::ExitCode {
    command::main()
}
