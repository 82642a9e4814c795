//! Tasks of those who work on Shellock: the checks before a commit, and the way to what takes long to build.
//!
//! This program has few dependencies, so that the checks start soon. Studies, goldens, pictures and the guide
//! of options need the product's crates; the program `studies` has them and is built when they are asked for.
//! `cargo xtask --help` lists all.

mod check;
mod problem;
mod words;

use std::ffi::OsString;
use std::process::{Command, ExitCode};

use clap::{Parser, Subcommand};

/// Tasks of `studies`, each with its line in the help.
const STUDIES: [(&str, &str); 5] = [
    (
        "study",
        "Compare metrics or searches; writes charts (SVG) and tables",
    ),
    ("savings", "Make the table of what kits save over solid models"),
    ("golden", "Compare kits with recorded digests, or record them"),
    ("pictures", "Make the pictures of the documentation"),
    ("options", "Write the guide of all options, docs/guide/options.md"),
];

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Tasks of those who work on Shellock", after_help = studies())]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

/// List of the tasks of `studies` for the help.
fn studies() -> String {
    let lines = STUDIES.map(|(name, help)| format!("\n  {name:<10}{help}"));
    format!("Built when they are first asked for:{}", lines.concat())
}

#[derive(Subcommand)]
enum Task {
    /// Check format, lints and fast tests; stops at the first failure
    Check(check::Options),
    /// Check comments and line widths of all sources
    Words(words::Options),
    #[command(external_subcommand)]
    Study(Vec<OsString>),
}

fn main() -> ExitCode {
    let ended = match Arguments::parse().task {
        Task::Check(options) => check::run(&options),
        Task::Words(options) => words::run(&options),
        Task::Study(arguments) => return study(&arguments),
    };
    match ended {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("error: {problem}");
            ExitCode::FAILURE
        }
    }
}

/// Builds and runs `studies` with `arguments`, of which the first is the task.
fn study(arguments: &[OsString]) -> ExitCode {
    let is_task = |name: &OsString| STUDIES.iter().any(|(task, _)| name == task);
    if !arguments.first().is_some_and(is_task) {
        eprintln!("error: there is no such task; `cargo xtask --help` lists all");
        return ExitCode::from(2);
    }
    let status = Command::new(cargo())
        .args(["run", "--release", "--package", "studies", "--"])
        .args(arguments)
        .status();
    match status {
        Ok(status) => ExitCode::from(
            status
                .code()
                .and_then(|code| u8::try_from(code).ok())
                .unwrap_or(1),
        ),
        Err(problem) => {
            eprintln!("error: cargo cannot be run: {problem}");
            ExitCode::FAILURE
        }
    }
}

/// Path of the cargo that runs this program.
fn cargo() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}
