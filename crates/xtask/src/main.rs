//! Tools for working on Shellock that are no part of it: studies of its metrics and searches, as charts and tables.
//!
//! `cargo xtask study --help` lists them.

mod chart;
mod failure;
mod metrics;
mod model;
mod search;
mod statistics;
mod strength;
mod study;
mod table;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Tools for working on Shellock")]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// Compare metrics or searches; writes charts (SVG) and tables (CSV, Markdown)
    Study(study::Options),
}

fn main() -> ExitCode {
    let Task::Study(options) = Arguments::parse().task;
    match study::run(&options) {
        Ok(files) => {
            files.iter().for_each(|f| println!("{}", f.display()));
            ExitCode::SUCCESS
        }
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::FAILURE
        }
    }
}
