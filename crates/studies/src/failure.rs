//! Reasons why a study ended without its charts.

use std::path::PathBuf;

use shellock::ParamProblem;

/// Failure of a task, as one line for people.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A file could not be read or written.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A table lacks what the study needs.
    #[error("{path}: {problem}", path = path.display())]
    Table {
        /// Path of the table.
        path: PathBuf,
        /// Missing part, and its place.
        problem: String,
    },
    /// Some options are out of their ranges.
    #[error("{}", .0.join("; "))]
    Options(Vec<String>),
    /// A model cannot be studied.
    #[error("{path}: {problem}", path = path.display())]
    Model {
        /// Path of its file, or of its labels.
        path: PathBuf,
        /// Reason why the model cannot be studied.
        problem: String,
    },
    /// The program could not be built or run.
    #[error("{program}: {problem}")]
    Program {
        /// Name of the program.
        program: String,
        /// Error message in words.
        problem: String,
    },
    /// The program's output differs from the goldens.
    #[error("other than before: {}", .0.join("; "))]
    Changed(Vec<String>),
    /// The part of a metric that all plans share could not be computed.
    #[error("{metric}: {problem}")]
    Metric {
        /// Name of the metric.
        metric: String,
        /// Error message in words.
        problem: String,
    },
    /// The drawing library reported an error.
    #[error("cannot draw the chart \"{title}\": {problem}")]
    Chart {
        /// Title of the chart.
        title: String,
        /// Error message in words.
        problem: String,
    },
}

impl Failure {
    /// Fails if there are any `problems` with the options.
    pub fn unless_right(problems: impl IntoIterator<Item = ParamProblem>) -> Result<(), Self> {
        let problems: Vec<String> = problems.into_iter().map(|p| p.to_string()).collect();
        if problems.is_empty() {
            Ok(())
        } else {
            Err(Self::Options(problems))
        }
    }
}
