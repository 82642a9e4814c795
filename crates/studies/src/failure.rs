//! Why a study ended without its charts.

use std::path::PathBuf;

use shellock::params::ParamProblem;

/// One line for a person.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// A file could not be read or written.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// Which file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// A table does not have what the study needs.
    #[error("{path}: {problem}", path = path.display())]
    Table {
        /// Which file.
        path: PathBuf,
        /// What is missing, and where.
        problem: String,
    },
    /// Options out of their ranges.
    #[error("{}", .0.join("; "))]
    Options(Vec<String>),
    /// A model cannot be studied.
    #[error("{path}: {problem}", path = path.display())]
    Model {
        /// Its file, or that of its labels.
        path: PathBuf,
        /// Why not.
        problem: String,
    },
    /// The program could not be built or run.
    #[error("{program}: {problem}")]
    Program {
        /// Which.
        program: String,
        /// What it says.
        problem: String,
    },
    /// The program no longer writes or says what it did.
    #[error("other than before: {}", .0.join("; "))]
    Changed(Vec<String>),
    /// What a metric computes once for all plans could not be computed.
    #[error("{metric}: {problem}")]
    Metric {
        /// Its name.
        metric: String,
        /// What it says.
        problem: String,
    },
    /// The drawing library refused.
    #[error("cannot draw the chart \"{title}\": {problem}")]
    Chart {
        /// The chart's title.
        title: String,
        /// What it says.
        problem: String,
    },
}

impl Failure {
    /// Refuses options that have `problems`.
    pub fn unless_right(problems: impl IntoIterator<Item = ParamProblem>) -> Result<(), Self> {
        let problems: Vec<String> = problems.into_iter().map(|p| p.to_string()).collect();
        if problems.is_empty() {
            Ok(())
        } else {
            Err(Self::Options(problems))
        }
    }
}
