//! Checks before a commit: format, lints and fast tests, and the rules for words.

use std::process::Command;
use std::time::Instant;

use clap::{Args, ValueEnum};

use crate::problem::Problem;
use crate::{cargo, words};

/// Crates with fast unit tests: 0.01 to 7 s each on one core, 30 s in all. Those of `shellock` take 80 s.
/// `shellock-python` gives dependencies the features of the whole workspace: nothing is compiled twice.
const FAST: [&str; 19] = [
    "shellock-report",
    "shellock-geom",
    "shellock-formats",
    "shellock-mechanics",
    "shellock-segment",
    "shellock-figures",
    "shellock-assembly",
    "shellock-render",
    "shellock-surface",
    "shellock-plan",
    "shellock-print",
    "shellock-kit",
    "shellock-job",
    "shellock-studio",
    "shellock-cli",
    "shellock-check",
    "shellock-testkit",
    "shellock-python",
    "xtask",
];
/// Tests beside unit tests that are fast, too: the order of crates and modules, and the guide of options.
const FAST_TARGETS: [&str; 2] = ["architecture", "options"];
/// Unit tests of these crates that are slow: 13 s.
const SLOW: [&str; 1] =
    ["play::tests::a_drawer_is_found_to_come_out_and_a_ball_that_spins_in_its_socket_is_not"];

/// Steps to take, in the order of their list.
#[derive(Args)]
pub struct Options {
    /// Steps to take [default: all]
    #[arg(value_enum)]
    steps: Vec<Step>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Step {
    Format,
    Words,
    Lints,
    Tests,
}

impl Step {
    /// Steps of a check, the quickest first.
    const ALL: [Self; 4] = [Self::Format, Self::Words, Self::Lints, Self::Tests];

    fn name(self) -> &'static str {
        match self {
            Self::Format => "format",
            Self::Words => "words",
            Self::Lints => "lints",
            Self::Tests => "tests",
        }
    }

    fn run(self) -> Result<(), Problem> {
        match self {
            Self::Format => format(),
            Self::Words => words::run(&words::Options::default()),
            Self::Lints => lints(),
            Self::Tests => tests(),
        }
    }
}

/// Takes the steps one by one and prints the duration of each; stops at the first failure.
pub fn run(options: &Options) -> Result<(), Problem> {
    let all = Instant::now();
    let steps = if options.steps.is_empty() {
        &Step::ALL[..]
    } else {
        &options.steps
    };
    for step in steps {
        println!("== {}", step.name());
        let since = Instant::now();
        step.run()?;
        println!("== {}: {:.1} s", step.name(), since.elapsed().as_secs_f64());
    }
    println!("== all passed in {:.0} s", all.elapsed().as_secs_f64());
    Ok(())
}

fn format() -> Result<(), Problem> {
    let advice = "run `cargo fmt --all`";
    run_cargo("format", advice, &["fmt", "--all", "--check"])
}

fn lints() -> Result<(), Problem> {
    let clippy = "clippy --release --workspace --all-targets --locked --quiet -- --deny warnings";
    let words: Vec<&str> = clippy.split(' ').collect();
    run_cargo("lints", "fix what clippy reports above", &words)
}

fn tests() -> Result<(), Problem> {
    let mut words = vec![
        "test",
        "--release",
        "--locked",
        "--quiet",
        "--lib",
        "--bin",
        "xtask",
    ];
    words.extend(FAST_TARGETS.iter().flat_map(|name| ["--test", name]));
    words.extend(FAST.iter().flat_map(|name| ["--package", name]));
    words.push("--");
    words.extend(SLOW.iter().flat_map(|name| ["--skip", name]));
    let advice = "run the failed test alone: `cargo test --release -p CRATE NAME`";
    run_cargo("tests", advice, &words)
}

/// Runs cargo with `words`; `advice` says what to do if it fails.
fn run_cargo(step: &'static str, advice: &str, words: &[&str]) -> Result<(), Problem> {
    let failure = |advice: String| Problem::Step { step, advice };
    let status = Command::new(cargo()).args(words).status();
    match status {
        Ok(status) if status.success() => Ok(()),
        Ok(_) => Err(failure(advice.to_owned())),
        Err(problem) => Err(failure(format!("cargo cannot be run: {problem}"))),
    }
}
