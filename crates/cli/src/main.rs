//! Entry point of the program `shellock`.

use std::process::ExitCode;

fn main() -> ExitCode {
    shellock_cli::command_line()
}
