//! Tasks of those who work on Shellock that need its crates: studies of its metrics and searches, as charts
//! and tables, goldens, the pictures of its documentation, and the guide of options.
//!
//! `cargo xtask` builds and runs this program; `cargo xtask --help` lists the tasks.

mod agreement;
mod chart;
mod convergence;
mod effort;
mod failure;
mod golden;
mod hard;
mod hours;
mod loads;
mod metrics;
mod model;
mod options;
mod pictures;
mod savings;
mod search;
mod segmentations;
mod sheet;
mod sides;
mod speed;
mod statistics;
mod strength;
mod study;
mod table;
mod worse;

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
    /// Make the table of what kits save over solid models, from what `shellock report` left in their folders
    Savings(savings::Options),
    /// Compare what the program writes and says with what it wrote and said before, byte by byte
    Golden(golden::Options),
    /// Make the pictures of the documentation from a kit of the program's own
    Pictures(pictures::Options),
    /// Write the guide of all options
    Options(options::Options),
}

fn main() -> ExitCode {
    let made = match Arguments::parse().task {
        Task::Study(options) => study::run(&options),
        Task::Savings(options) => savings::run(&options),
        Task::Golden(options) => golden::run(&options),
        Task::Pictures(options) => pictures::run(&options),
        Task::Options(options) => options::run(&options),
    };
    match made {
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
